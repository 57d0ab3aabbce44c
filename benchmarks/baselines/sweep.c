/* Steady states over speed of one mass on a mesh whose force is given at the begin, middle and end of every step.
 *
 *     mass x'' + damping x' + F(phase, x) = load      (um, N; a force of 1 N accelerates 1 kg by 1e6 um/s^2)
 *
 * The classical Runge-Kutta method of order four; the same force as that of jaxgear's ForceMap: cubic pieces over the
 * approach, linear beyond. Places 2 i, 2 i + 1 and 2 i + 2 times a stride belong to
 * step i, so that speeds with fewer steps use the same table. A speed
 * begins with the state of the one before and is integrated until the state repeats after one to MOST_PERIODS cycles.
 */
#include <math.h>

#define MOST_PERIODS 4
#define NEWTON 1e6

/* the levels lie closer where the flanks begin to touch: distance of the first two in that of evenly spaced ones */
#define FIRST_STEP 0.3
/* an orbit of several cycles counts as one only if its cycles differ by so many tolerances */
#define APART 30.0

typedef struct {
    long levels;
    double reach, mass, damping, load;
    const double *start; /* (places, 2): approach at which drive and coast flanks touch */
    const double *force; /* (places, 2, levels) */
    const double *rise;  /* (places, 2, levels): slope over the number of the level */
} Model;

typedef struct {
    double x, v;
} State;

typedef struct {
    double frequency;
    long steps, stride;
} Speed;

static inline double mesh_force(const Model *m, long place, double q) {
    const double *start = m->start + 2 * place;
    int drive = q >= 0.5 * (start[0] - start[1]);
    double closed = drive ? q - start[0] : -q - start[1];
    double share = closed / m->reach, bend = (1 - FIRST_STEP) / (FIRST_STEP * FIRST_STEP);
    if (closed <= 0)
        return 0;
    double level = share < 1 ? 2 * share / (FIRST_STEP * (1 + sqrt(1 + 4 * bend * share)))
                             : 1 + (share - 1) / (2 - FIRST_STEP);
    level *= m->levels - 1;
    long below = (long)level;
    if (below > m->levels - 2)
        below = m->levels - 2;
    long node = (2 * place + !drive) * m->levels + below;
    double part = level - below, inside = part < 1 ? part : 1;
    double low = m->force[node], rise = m->rise[node], end = m->rise[node + 1];
    double jump = m->force[node + 1] - low;
    double cubic = rise + inside * (3 * jump - 2 * rise - end + inside * (rise + end - 2 * jump));
    double found = low + inside * cubic + end * (part - inside);
    return drive ? found : -found;
}

static inline double acceleration(const Model *m, long place, double x, double v) {
    return NEWTON * (m->load - mesh_force(m, place, x) - m->damping * v) / m->mass;
}

static inline State stepped(const Model *m, long first, long stride, State y, double h) {
    long middle = first + stride, last = middle + stride;
    double v1 = y.v, a1 = acceleration(m, first, y.x, v1);
    double v2 = y.v + 0.5 * h * a1, a2 = acceleration(m, middle, y.x + 0.5 * h * v1, v2);
    double v3 = y.v + 0.5 * h * a2, a3 = acceleration(m, middle, y.x + 0.5 * h * v2, v3);
    double v4 = y.v + h * a3, a4 = acceleration(m, last, y.x + h * v3, v4);
    State end = {y.x + h / 6 * (v1 + 2 * (v2 + v3) + v4), y.v + h / 6 * (a1 + 2 * (a2 + a3) + a4)};
    return end;
}

static State over_cycle(const Model *m, State y, Speed at) {
    double h = 1 / (at.steps * at.frequency);
    for (long i = 0; i < at.steps; i++)
        y = stepped(m, 2 * i * at.stride, at.stride, y, h);
    return y;
}

/* Largest force and the sums of x - origin and of its square over a cycle, by three places of every step. */
static State recorded(const Model *m, State y, Speed at, double origin, double *numbers) {
    double h = 1 / (at.steps * at.frequency);
    for (long i = 0; i < at.steps; i++) {
        long place = 2 * i * at.stride;
        State end = stepped(m, place, at.stride, y, h);
        double middle = 0.5 * (y.x + end.x) + h * (y.v - end.v) / 8;
        double f0 = mesh_force(m, place, y.x), f1 = mesh_force(m, place + at.stride, middle);
        double f2 = mesh_force(m, place + 2 * at.stride, end.x);
        double bend = 2 * f0 - 4 * f1 + 2 * f2, slope = -3 * f0 + 4 * f1 - f2;
        double top = fmax(f0, f2);
        if (bend < 0 && slope > 0 && slope < -2 * bend)
            top = fmax(top, f0 - slope * slope / (4 * bend));
        numbers[0] = fmax(numbers[0], top);
        double a = y.x - origin, b = middle - origin, c = end.x - origin;
        numbers[1] += (a + 4 * b + c) / (6 * at.steps);
        numbers[2] += (a * a + 4 * b * b + c * c) / (6 * at.steps);
        y = end;
    }
    return y;
}

/* State after some cycles. */
void settle(const Model *m, double frequency, long steps, long cycles, double *state) {
    State y = {state[0], state[1]};
    Speed at = {frequency, steps, 1};
    for (long n = 0; n < cycles; n++)
        y = over_cycle(m, y, at);
    state[0] = y.x;
    state[1] = y.v;
}

/* Numbers of every speed: largest force, rms of x, and mesh cycles that were integrated, negative if not settled. */
void sweep(const Model *m, long speeds, const double *frequency, const long *steps, long most_steps, double tolerance,
           long most_cycles, double *state, double *numbers) {
    State y = {state[0], state[1]};
    for (long s = 0; s < speeds; s++) {
        State past[MOST_PERIODS];
        Speed at = {frequency[s], steps[s], most_steps / steps[s]};
        long cycle = 0, period = 0;
        double scale = 1 / (2 * M_PI * frequency[s]), sums[3] = {-HUGE_VAL, 0, 0};
        while (cycle < most_cycles && !period) {
            past[cycle % MOST_PERIODS] = y;
            y = over_cycle(m, y, at);
            cycle++;
            double nearest = HUGE_VAL, size = fmax(fabs(y.x), fabs(y.v) * scale);
            for (long n = 1; n <= MOST_PERIODS && n <= cycle && !period; n++) {
                State then = past[(cycle - n) % MOST_PERIODS];
                double away = fmax(fabs(y.x - then.x), fabs(y.v - then.v) * scale) / size;
                if (away < tolerance && nearest > APART * tolerance)
                    period = n;
                nearest = fmin(nearest, away);
            }
        }
        double origin = y.x;
        long count = period ? period : MOST_PERIODS;
        for (long n = 0; n < count; n++)
            y = recorded(m, y, at, origin, sums);
        double mean = sums[1] / count;
        numbers[3 * s] = sums[0];
        numbers[3 * s + 1] = sqrt(fmax(sums[2] / count - mean * mean, 0));
        numbers[3 * s + 2] = period ? cycle + count : -(cycle + count);
    }
}
