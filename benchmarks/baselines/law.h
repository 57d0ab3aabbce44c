/* The table of the C kernel, and approach and slope of one pair: depth-referenced Hertz with the softening of the tip
 * corner, all divided by the lever of the pair. See kernel.c.
 */
#include <math.h>

#define LANES 8
#define NODES 4
#define SERIES 5

static const double LOAD_FLOOR = 1e-6;
typedef double Lanes[LANES];

/* every field is one row of the table that c_kernel.py fills, in this order */
typedef struct {
    Lanes gap;             /* corner gap */
    Lanes inverse_lever;
    Lanes load;            /* F, line load of the pair alone */
    Lanes cross;           /* coupling compliance */
    Lanes alone;           /* approach under F alone, without gap */
    Lanes half;            /* approach at t = 1/2, without gap */
    Lanes series[SERIES];  /* b without corner: sum series_n s^n - logarithm ln s, s = q + floor */
    Lanes logarithm;
    Lanes width_factor;
    Lanes truncation;
    Lanes distance;        /* from the corner */
    Lanes wedge;
    Lanes reach;           /* (2 reach / 1.82)^4 */
    Lanes beyond[2][NODES]; /* roll length beyond the tip of pinion and wheel */
    Lanes may_cut;         /* 1 if any contact of the block can reach the corner at all */
    Lanes furthest[2];     /* largest value of `beyond` over block and nodes */
} Pair;

typedef struct {
    Pair pair[2];
} Block;

/* approach and slope of one pair under the line load q; cut: whether the contact may reach the tip corner */
static inline __attribute__((always_inline)) void elastic(
    const Pair *p, int k, double q, int cut, double *value, double *slope)
{
    const double s = q + LOAD_FLOOR, log_s = log(s);
    double bracket = p->series[SERIES - 1][k], growth = (SERIES - 1) * bracket;
    for (int n = SERIES - 2; n >= 0; n--) {
        bracket = bracket * s + p->series[n][k];
        if (n > 0)
            growth = growth * s + n * p->series[n][k];
    }
    growth = growth * s - p->logarithm[k]; /* s db/ds */
    bracket -= p->logarithm[k] * log_s;

    const double squared = p->width_factor[k] * s, distance = p->distance[k];
    /* full contact; the lengths are those of jaxgear.compliance.edge times the half width */
    const int full = distance > 0 && distance * distance > squared;
    const double root = sqrt(full ? distance * distance - squared : 1.0);
    const double reach = 1 / (full ? distance + root : 1.0);
    const double ratio = squared * reach * reach;
    double span = reach * reach * reach * reach * exp(-2 * (full ? ratio : 0.0));
    double fall = 0.5 * ratio; /* d ln(span) / d ln(s) / 4 */
    if (cut) {
        const double edge = sqrt(distance * distance + 3 * squared), inverse = 1 / edge;
        const int inside = distance > 0;
        const double length = inside ? 2.0 / 3.0 * (distance + edge) : 2 * squared / (edge - distance);
        const double middle = 0.5 * length - distance, quarter = 0.25 * length - distance, over = length * inverse;
        const double sagitta = inside ? middle * middle : length * quarter;
        const double turn = distance * (inside ? middle * (over - 2) : over * quarter + length * (0.25 * over - 1));
        const double per = 1 / squared, l2 = length * length * per;
        const double phi = 0.5 * sagitta * per + l2 / 16 - 0.25 * log(0.25 * l2) - 0.25;
        const double along = 0.5 * turn * per + (l2 / 8 - 0.5) * distance * inverse; /* tau dphi/dtau */
        const double weight = full ? 0.0 : p->truncation[k];
        bracket += weight * phi;
        growth -= 0.5 * weight * along;
        /* full contact has 1/2 of its length and exp(1 / (2 g^2)) where this has 1/4 and exp(1/2) */
        const double start = 16 * 0.1353352832366127 / ((length * length) * (length * length));
        span = full ? span : start;
        fall = full ? fall : -0.5 - (-0.5) * distance * inverse;
    }
    span *= p->reach[k];
    bracket += 0.25 * p->wedge[k] * log(1 + span);
    growth += p->wedge[k] * fall * span / (1 + span);
    *value = q * bracket;
    *slope = bracket + growth * q / s;
}
