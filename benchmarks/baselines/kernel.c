/* PPTE and its gradient of many variants of a parabolic tip relief on both gears, two pairs per position.
 *
 * All quantities of a pair are divided by its lever, so that a closed pair i has the approach
 *
 *     D_i = gap_i + q_i b_i(q_i) + cross_i q_j,    b = deflection of tooth, body and contact per line load.
 *
 * With both pairs closed the load balance leaves one unknown, the share t that pair 0 has of its full load,
 * q_0 = t F_0, q_1 = (1 - t) F_1, and one equation D_0(t) = D_1(t), increasing in t. Its signs at t = 0 and t = 1 tell
 * which pairs touch; one pair alone needs no iteration. Eight positions make a block, the loops over its lanes are the
 * vector loops. The flank's part of the law is a logarithm plus a power series, see c_kernel.py.
 *
 * With several slices the equations above hold in each of them for the same approach; from the solution for one slice on
 * Newton's method on the active set finds the rest.
 */
#include "law.h"

#define MAX_BLOCKS 64
#define MAX_SLICES 64
#define MAX_STEPS 20
/* the table holds for line loads of the slices up to this multiple of a uniform one */
#define PEAK 3

/* a Newton step in t this small leaves an error of its square */
static const double SMALL = 1e-7;
/* the same of the approach [um] */
static const double SMALL_APPROACH = 1e-6;
/* weights of the points across the contact, 2/5 sin^2(n pi / 5) */
static const double WEIGHT[NODES] = {0.1381966011250105, 0.3618033988749895, 0.3618033988749895, 0.1381966011250105};

int block_rows(void) { return sizeof(Block) / sizeof(Lanes); }

static inline __attribute__((always_inline)) void gaps(
    const Pair *p, const double *variant, double *gap)
{
    double total[LANES] = {0};
    for (int gear = 0; gear < 2; gear++) {
        const double amount = variant[2 * gear], length = variant[2 * gear + 1], inverse = 1 / length;
        if (p->furthest[gear][0] + length <= 0)
            continue;
        for (int node = 0; node < NODES; node++)
            for (int k = 0; k < LANES; k++) {
                double d = 1 + p->beyond[gear][node][k] * inverse;
                d = d < 0 ? 0 : d > 1 ? 1 : d;
                total[k] += amount * WEIGHT[node] * d * (0.44 + 0.56 * d);
            }
    }
    for (int k = 0; k < LANES; k++)
        gap[k] = p->gap[k] + p->inverse_lever[k] * total[k];
}

/* one Newton step in t for a block; returns the largest step */
static inline __attribute__((always_inline)) double newton(
    const Pair *a, const Pair *b, const double *open, const double *both, double *t, double *approach, double *share,
    int cut_a, int cut_b)
{
    double largest = 0;
    for (int k = 0; k < LANES; k++) {
        const double first = t[k] * a->load[k], second = (1 - t[k]) * b->load[k];
        double h_a, k_a, h_b, k_b;
        elastic(a, k, first, cut_a, &h_a, &k_a);
        elastic(b, k, second, cut_b, &h_b, &k_b);
        const double d_a = h_a + a->cross[k] * second, d_b = h_b + b->cross[k] * first;
        const double up = k_a * a->load[k] - a->cross[k] * b->load[k];
        const double down = k_b * b->load[k] - b->cross[k] * a->load[k];
        const double per = 1 / (up + down);
        double step = (d_b - d_a - open[k]) * per;
        /* keeps t inside (0, 1) */
        const double least = -0.9 * t[k], most = 0.9 * (1 - t[k]);
        step = step < least ? least : step > most ? most : step;
        approach[k] = both[k] > 0 ? d_a + up * step : approach[k]; /* without gap a */
        share[k] = both[k] > 0 ? down * per : share[k];
        step *= both[k];
        t[k] += step;
        const double size = fabs(step);
        largest = size > largest ? size : largest;
    }
    return largest;
}

/* approaches of all positions of a block for one slice; share: weight of pair 0 in the derivative by the gaps;
 * returns whether the iteration has settled */
static int one_slice(
    const Block *data, const double *gap_a, const double *gap_b, double *t, double *approach, double *share)
{
    const Pair *a = &data->pair[0], *b = &data->pair[1];
    double open[LANES], both[LANES], largest = 0;
    int any = 0;
    for (int k = 0; k < LANES; k++) {
        open[k] = gap_a[k] - gap_b[k];
        const double low = open[k] + a->cross[k] * b->load[k] - b->alone[k];
        const double high = open[k] + a->alone[k] - b->cross[k] * a->load[k];
        const double mid = open[k] + a->half[k] - b->half[k];
        const int first = high <= 0, second = low >= 0;
        /* inverse quadratic interpolation through t = 0, 1/2, 1 */
        double guess = low / (high - mid) * (mid / (high - low) - 0.5 * high / (mid - low));
        guess = guess < 0.02 ? 0.02 : guess > 0.98 ? 0.98 : guess;
        both[k] = first || second ? 0.0 : 1.0;
        t[k] = first ? 1.0 : second ? 0.0 : guess;
        share[k] = first ? 1.0 : 0.0;
        approach[k] = first ? a->alone[k] : b->alone[k] - open[k];
        any |= !(first || second);
    }
    if (any) {
        const int cut_a = a->may_cut[0] > 0, cut_b = b->may_cut[0] > 0;
        for (int step = 0; step < MAX_STEPS; step++) {
            if (cut_a && cut_b)
                largest = newton(a, b, open, both, t, approach, share, 1, 1);
            else if (cut_a)
                largest = newton(a, b, open, both, t, approach, share, 1, 0);
            else if (cut_b)
                largest = newton(a, b, open, both, t, approach, share, 0, 1);
            else
                largest = newton(a, b, open, both, t, approach, share, 0, 0);
            if (largest < SMALL)
                break;
        }
    }
    for (int k = 0; k < LANES; k++)
        approach[k] += gap_a[k];
    return largest < SMALL;
}

/* one Newton step of all slices; returns the largest change of the approach */
static inline __attribute__((always_inline)) double sweep(
    const Pair *a, const Pair *b, const double *gap_a, const double *gap_b, int slices, const double *crowning,
    Lanes *load_a, Lanes *load_b, double *approach, double *share, int cut_a, int cut_b)
{
    Lanes unit_a[MAX_SLICES], unit_b[MAX_SLICES], sum_a = {0}, sum_b = {0}, part = {0}, next;
    double largest = 0;
    for (int s = 0; s < slices; s++)
        for (int k = 0; k < LANES; k++) {
            const double q_a = load_a[s][k], q_b = load_b[s][k], cross_a = a->cross[k], cross_b = b->cross[k];
            const double g_a = gap_a[k] + a->inverse_lever[k] * crowning[s];
            const double g_b = gap_b[k] + b->inverse_lever[k] * crowning[s];
            double h_a, k_a, h_b, k_b;
            elastic(a, k, q_a, cut_a, &h_a, &k_a);
            elastic(b, k, q_b, cut_b, &h_b, &k_b);
            const double known_a = k_a * q_a - h_a - g_a, known_b = k_b * q_b - h_b - g_b;
            const int on_a = known_a + approach[k] > cross_a * q_b, on_b = known_b + approach[k] > cross_b * q_a;
            /* (k_a, cross_a; cross_b, k_b) on the active rows, the unit matrix on the others */
            const double m_a = on_a ? k_a : 1, m_b = on_b ? k_b : 1;
            const double c_a = on_a && on_b ? cross_a : 0, c_b = on_a && on_b ? cross_b : 0;
            const double r_a = on_a ? known_a : 0, r_b = on_b ? known_b : 0;
            const double one_a = on_a ? 1 : 0, one_b = on_b ? 1 : 0, per = 1 / (m_a * m_b - c_a * c_b);
            load_a[s][k] = (m_b * r_a - c_a * r_b) * per;
            load_b[s][k] = (m_a * r_b - c_b * r_a) * per;
            unit_a[s][k] = (m_b * one_a - c_a * one_b) * per;
            unit_b[s][k] = (m_a * one_b - c_b * one_a) * per;
            part[k] += load_a[s][k] / a->load[k] + load_b[s][k] / b->load[k];
            sum_a[k] += unit_a[s][k] / a->load[k];
            sum_b[k] += unit_b[s][k] / b->load[k];
        }
    for (int k = 0; k < LANES; k++) {
        const double per = 1 / (sum_a[k] + sum_b[k]), change = fabs((slices - part[k]) * per - approach[k]);
        next[k] = (slices - part[k]) * per;
        share[k] = sum_a[k] * per;
        largest = change > largest ? change : largest;
    }
    for (int k = 0; k < LANES; k++)
        approach[k] = next[k];
    for (int s = 0; s < slices; s++)
        for (int k = 0; k < LANES; k++) {
            const double q_a = load_a[s][k] + unit_a[s][k] * next[k], q_b = load_b[s][k] + unit_b[s][k] * next[k];
            load_a[s][k] = q_a > 0 ? q_a : 0;
            load_b[s][k] = q_b > 0 ? q_b : 0;
        }
    return largest;
}

/* as one_slice, for several slices with `crowning` [um] added to their gaps */
static int many_slices(
    const Block *data, const double *gap_a, const double *gap_b, int slices, const double *crowning, double *approach,
    double *share)
{
    const Pair *a = &data->pair[0], *b = &data->pair[1];
    Lanes load_a[MAX_SLICES], load_b[MAX_SLICES], mean_a, mean_b, t;
    double mean = 0, largest = 1;
    for (int s = 0; s < slices; s++)
        mean += crowning[s] / slices;
    for (int k = 0; k < LANES; k++) {
        mean_a[k] = gap_a[k] + a->inverse_lever[k] * mean;
        mean_b[k] = gap_b[k] + b->inverse_lever[k] * mean;
    }
    one_slice(data, mean_a, mean_b, t, approach, share);
    for (int s = 0; s < slices; s++)
        for (int k = 0; k < LANES; k++) {
            load_a[s][k] = t[k] * a->load[k];
            load_b[s][k] = (1 - t[k]) * b->load[k];
        }
    const int cut_a = a->may_cut[0] > 0, cut_b = b->may_cut[0] > 0;
    /* from equal loads the first step does not move the approach: it tells nothing about convergence */
    for (int step = 0; step < 2 || (step < MAX_STEPS && largest >= SMALL_APPROACH); step++) {
        if (cut_a || cut_b)
            largest = sweep(a, b, gap_a, gap_b, slices, crowning, load_a, load_b, approach, share, 1, 1);
        else
            largest = sweep(a, b, gap_a, gap_b, slices, crowning, load_a, load_b, approach, share, 0, 0);
    }
    int settled = largest < SMALL_APPROACH;
    for (int s = 0; s < slices; s++)
        for (int k = 0; k < LANES; k++)
            settled &= load_a[s][k] < PEAK * a->load[k] && load_b[s][k] < PEAK * b->load[k];
    return settled;
}

/* adds sign times the gradient of the approach at one position */
static void add_gradient(
    const Block *blocks, int position, const double *variant, const double *share, double sign, double *gradient)
{
    const int k = position % LANES;
    for (int i = 0; i < 2; i++) {
        const Pair *p = &blocks[position / LANES].pair[i];
        const double factor = sign * p->inverse_lever[k] * (i ? 1 - share[position] : share[position]);
        for (int gear = 0; gear < 2; gear++)
            for (int node = 0; node < NODES; node++) {
                const double amount = variant[2 * gear], length = variant[2 * gear + 1];
                const double beyond = p->beyond[gear][node][k], d = 1 + beyond / length;
                if (d <= 0)
                    continue;
                const double e = d > 1 ? 1 : d;
                gradient[2 * gear] += factor * WEIGHT[node] * e * (0.44 + 0.56 * e);
                if (d < 1)
                    gradient[2 * gear + 1] -=
                        factor * WEIGHT[node] * amount * (0.44 + 1.12 * d) * beyond / (length * length);
            }
    }
}

/* variants: (count, 4); crowning: (slices); ppte: (count), nan where the iteration has not settled;
 * gradient: (count, 4) or null */
void evaluate(
    const Block *blocks, int positions, int slices, const double *crowning, const double *variants, long count,
    double *ppte, double *gradient)
{
    double approach[MAX_BLOCKS * LANES], share[MAX_BLOCKS * LANES];
    for (long v = 0; v < count; v++) {
        const double *variant = variants + 4 * v;
        int settled = 1;
        for (int i = 0; i * LANES < positions; i++) {
            Lanes gap_a, gap_b, t;
            gaps(&blocks[i].pair[0], variant, gap_a);
            gaps(&blocks[i].pair[1], variant, gap_b);
            double *d = approach + i * LANES, *w = share + i * LANES;
            settled &= slices == 1 ? one_slice(&blocks[i], gap_a, gap_b, t, d, w)
                                   : many_slices(&blocks[i], gap_a, gap_b, slices, crowning, d, w);
        }
        int top = 0, bottom = 0;
        for (int n = 1; n < positions; n++) {
            top = approach[n] > approach[top] ? n : top;
            bottom = approach[n] < approach[bottom] ? n : bottom;
        }
        ppte[v] = settled ? approach[top] - approach[bottom] : NAN;
        if (gradient) {
            double *g = gradient + 4 * v;
            g[0] = g[1] = g[2] = g[3] = 0;
            add_gradient(blocks, top, variant, share, 1, g);
            add_gradient(blocks, bottom, variant, share, -1, g);
        }
    }
}
