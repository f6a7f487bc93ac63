// SPDX-License-Identifier: Apache-2.0
#include <float.h>
#include <stdint.h>

#if defined(__FAST_MATH__)
#error "NAME: the error bounds do not hold with -ffast-math; compile without it"
#endif
#if !defined(FLT_EVAL_METHOD) || FLT_EVAL_METHOD != 0
#error "NAME: the error bounds need FLT_EVAL_METHOD 0: float and double without additional digits"
#endif
//@ if certified
#if !defined(PALPATE_RATE_HZ) || PALPATE_RATE_HZ != RATE_HZ
#error "NAME: the certificate holds for RATE_HZ ticks a second; define PALPATE_RATE_HZ RATE_HZ if the device runs at it"
#endif
#if !defined(PALPATE_PROFILE) || PALPATE_PROFILE != PROFILE
#error "NAME: the certificate holds for one device; define PALPATE_PROFILE PROFILE if its profile is DEVICE"
#endif
//@ end

//@ constants

//@ if single
typedef float NAME_real;
//@ else
typedef double NAME_real;
//@ end

typedef struct NAME_state {
//@ if hysteretic and single
    int32_t anchor;  /* count at which the play operator moved last */
    NAME_real side;  /* direction state at that count: -1, 0 or 1 */
//@ end
//@ if hysteretic and not single
    double play;     /* position of the play operator */
//@ end
//@ if predicted and single
    int32_t past[NAME_TAPS]; /* last counts */
    uint32_t sum;    /* of the last counts */
//@ end
//@ if predicted and not single
    double past[NAME_TAPS]; /* last positions */
//@ end
//@ if predicted
    uint32_t oldest; /* index of the oldest one */
//@ end
//@ if massless
    NAME_real lag;   /* of the object behind the device: counts, or with doubles a position */
//@ end
//@ if memory
    double coordinate; /* of the branches at the last tick */
    double stretch[NAME_BRANCHES]; /* of the spring of each branch */
//@ end
//@ if stateless
    uint8_t unused;
//@ end
} NAME_state;

/* Functions that are part of every tick are always inlined, because a call costs as much as a polynomial. */
#if defined(__GNUC__)
#define NAME_INLINE static inline __attribute__((always_inline))
#else
#define NAME_INLINE static inline
#endif

#define NAME_ZERO ((NAME_real)0)
#define NAME_ONE ((NAME_real)1)
#define NAME_HALF ((NAME_real)0.5)

//@ tables
/* ---------------------------------------------------------------------------------------------------- polynomials */

/* Value of a polynomial of degree 5. */
NAME_INLINE NAME_real NAME_polynomial(const NAME_real *c, NAME_real t) {
    return ((((c[5] * t + c[4]) * t + c[3]) * t + c[2]) * t + c[1]) * t + c[0];
}

/* Value of a polynomial of degree 5, and its derivative by t. */
NAME_INLINE NAME_real NAME_polynomial_slope(const NAME_real *c, NAME_real t, NAME_real *derivative) {
    NAME_real value = c[5] * t + c[4];
    NAME_real slope = c[5] * t + value;
    value = value * t + c[3];
    slope = slope * t + value;
    value = value * t + c[2];
    slope = slope * t + value;
    value = value * t + c[1];
    *derivative = slope * t + value;
    return value * t + c[0];
}

//@ each TABLE in tables
/* ---------------------------------------------------------------------------------------- places in the table TABLE */

//@ if single
/* Coefficients of the cell at a phase. Also returns the place t in the cell, -1/2 <= t < 1/2, and k: the coarse cell
   has 2^k cells. The highest bits of a phase are the number of the coarse cell. */
NAME_INLINE const NAME_real *NAME_TABLE_cell(uint32_t phase, NAME_real *t, uint32_t *k) {
    const uint32_t split = NAME_TABLE_splits[phase >> (32 - NAME_TABLE_BITS)];
    const uint32_t rest = phase << NAME_TABLE_BITS;
    *k = split & 15u;
    *t = (NAME_real)(int32_t)((rest << *k) ^ 0x80000000u) * 2.3283064365386963e-10f;
    return NAME_TABLE_cells[(split >> 4) + ((rest >> 1) >> (31u - *k))];
}

//@ if periodic
/* Phase of a count, in units of 2^-32 of a period. */
NAME_INLINE uint32_t NAME_TABLE_phase(int32_t count) {
    return (uint32_t)(((uint64_t)(int64_t)count * NAME_TABLE_PHASE_STEP + NAME_TABLE_PHASE_START) >> 32);
}
//@ else
/* Phase of a count. */
NAME_INLINE uint32_t NAME_TABLE_phase(int32_t count) {
    return ((uint32_t)count - (uint32_t)NAME_TABLE_ORIGIN) << NAME_TABLE_SHIFT;
}
//@ end

//@ if TABLE_between
/* Finds a count plus a fraction of a count. Returns 1 and the phase if it lies in the domain, otherwise 0, the distance
   from the domain in counts, and 1 in `below` if it lies below. */
NAME_INLINE int NAME_TABLE_find(int32_t count, NAME_real fraction, uint32_t *phase, NAME_real *distance, int *below) {
    *phase = NAME_TABLE_phase(count) + (uint32_t)(int32_t)(fraction * NAME_TABLE_PER_COUNT);
    *below = 0;
    *distance = NAME_ZERO;
//@ if not periodic
    if ((uint32_t)count - (uint32_t)NAME_TABLE_ORIGIN > (uint32_t)(NAME_TABLE_LAST - NAME_TABLE_ORIGIN + 1) ||
        *phase - NAME_TABLE_PHASE_LOWER > NAME_TABLE_PHASE_UPPER - NAME_TABLE_PHASE_LOWER) {
        *below = count < NAME_TABLE_MIDDLE;
        *distance = *below ? (NAME_real)(NAME_TABLE_FIRST - count) - fraction - NAME_TABLE_OFFSET_BELOW
                           : (NAME_real)(count - NAME_TABLE_LAST) + fraction - NAME_TABLE_OFFSET_ABOVE;
        return 0;
    }
//@ end
    return 1;
}
//@ end
//@ end

//@ if TABLE_positions
/* Number of the cell at a position of the domain. Also returns the place t in the cell, and k: the coarse cell has 2^k
   cells. */
NAME_INLINE uint32_t NAME_TABLE_cell_at(double position, double *t, uint32_t *k) {
    const double along = (position - NAME_TABLE_START) * NAME_TABLE_PER_COARSE;
    uint32_t coarse = (uint32_t)along;
    uint32_t split, cell;
    double part;
    coarse = coarse > NAME_TABLE_COARSE - 1u ? NAME_TABLE_COARSE - 1u : coarse;
    split = NAME_TABLE_splits[coarse];
    *k = split & 15u;
    part = (along - (double)coarse) * (double)(1u << *k);
    cell = (uint32_t)part;
    cell = cell > (1u << *k) - 1u ? (1u << *k) - 1u : cell;
    *t = part - (double)cell - 0.5;
    return (split >> 4) + cell;
}

//@ if periodic
/* Moves a position into the first period, and returns the number of periods by which it is moved. */
NAME_INLINE double NAME_TABLE_wrapped(double *position) {
    const double turns = (*position - NAME_TABLE_LOWER) * NAME_TABLE_PER_PERIOD;
    double whole;
    if (!(turns > -4e18 && turns < 4e18)) { /* not a finite number, or farther away than a double resolves */
        *position = NAME_TABLE_LOWER;
        return 0.0;
    }
    whole = (double)(int64_t)turns;
    whole = whole > turns ? whole - 1.0 : whole;
    *position -= whole * (NAME_TABLE_UPPER - NAME_TABLE_LOWER);
    *position = *position < NAME_TABLE_LOWER ? NAME_TABLE_LOWER
                : *position > NAME_TABLE_UPPER ? NAME_TABLE_UPPER : *position;
    return whole;
}
//@ end
//@ end
//@ end
/* ------------------------------------------------------------------------------------------------------- force law */

//@ if not periodic
/* Force and slope of a straight line {force, gain, slope, reach} at a distance outside the domain. From `reach` on both
   are zero. */
NAME_INLINE NAME_real NAME_line(const NAME_real *line, NAME_real distance, NAME_real *slope) {
    *slope = distance >= line[3] ? NAME_ZERO : line[2];
    return distance >= line[3] ? NAME_ZERO : line[0] + line[1] * distance;
}

//@ end
//@ if not memory
//@ if single and hysteretic
/* Direction state after a motion to a count, before it is limited to -1 and 1. */
NAME_INLINE NAME_real NAME_direction(const NAME_state *s, int32_t count) {
    return count >= s->anchor ? s->side + (NAME_real)((uint32_t)count - (uint32_t)s->anchor) * NAME_PER_PLAY
                              : s->side - (NAME_real)((uint32_t)s->anchor - (uint32_t)count) * NAME_PER_PLAY;
}

/* Moves the play operator to a count and returns the direction state. */
NAME_INLINE NAME_real NAME_moved(NAME_state *s, int32_t count) {
    NAME_real direction = NAME_direction(s, count);
    if (direction > NAME_ONE || direction < -NAME_ONE) {
        direction = direction > NAME_ONE ? NAME_ONE : -NAME_ONE;
        s->anchor = count;
        s->side = direction;
    }
    return direction;
}

//@ end
//@ if single and not hysteretic
/* Direction state: 0, because the force has no hysteresis. */
NAME_INLINE NAME_real NAME_direction(const NAME_state *s, int32_t count) {
    (void)s;
    (void)count;
    return NAME_ZERO;
}

NAME_INLINE NAME_real NAME_moved(NAME_state *s, int32_t count) { return NAME_direction(s, count); }

//@ end
//@ if hysteretic
/* Position of the play operator after a motion. */
NAME_INLINE double NAME_play(double position, double before) {
    const double low = position - NAME_PLAY_RADIUS;
    const double high = position + NAME_PLAY_RADIUS;
    const double play = before < low ? low : before;
    return play > high ? high : play;
}

//@ end
/* A direction state, limited to -1 and 1. */
NAME_INLINE NAME_real NAME_unit(NAME_real direction) {
    return direction > NAME_ONE ? NAME_ONE : direction < -NAME_ONE ? -NAME_ONE : direction;
}

//@ if hysteretic
/* Force in a cell: mean force plus hysteresis times direction state. */
NAME_INLINE NAME_real NAME_law_value(const NAME_real *c, NAME_real t, NAME_real direction) {
    return NAME_polynomial(c, t) + direction * NAME_polynomial(c + 6, t);
}

/* Force and slope in a cell. While the play operator sticks, the slope contains hysteresis / play radius. */
NAME_INLINE NAME_real NAME_law_slope(const NAME_real *c, NAME_real t, uint32_t k, NAME_real direction, int sticks,
                                     NAME_real *slope) {
    NAME_real of_mean, of_hysteresis;
    const NAME_real mean = NAME_polynomial_slope(c, t, &of_mean);
    const NAME_real hysteresis = NAME_polynomial_slope(c + 6, t, &of_hysteresis);
    *slope = of_mean * NAME_law_per_width[k] + direction * (of_hysteresis * NAME_law_per_width[k]);
    *slope = sticks ? *slope + hysteresis * NAME_PER_RADIUS : *slope;
    return mean + direction * hysteresis;
}

//@ else
/* Force in a cell. */
NAME_INLINE NAME_real NAME_law_value(const NAME_real *c, NAME_real t, NAME_real direction) {
    (void)direction;
    return NAME_polynomial(c, t);
}

/* Force and slope in a cell. */
NAME_INLINE NAME_real NAME_law_slope(const NAME_real *c, NAME_real t, uint32_t k, NAME_real direction, int sticks,
                                     NAME_real *slope) {
    NAME_real derivative;
    const NAME_real force = NAME_polynomial_slope(c, t, &derivative);
    (void)direction;
    (void)sticks;
    *slope = derivative * NAME_law_per_width[k];
    return force;
}

//@ end
//@ if not periodic
/* Force and slope at a distance outside the domain. */
static inline NAME_real NAME_law_outside(NAME_real distance, int below, NAME_real direction, int sticks,
                                         NAME_real *slope) {
    const NAME_real force = NAME_line(NAME_law_lines[below ? 0 : 1], distance, slope);
//@ if hysteretic
    NAME_real of_hysteresis;
    const NAME_real hysteresis = NAME_line(NAME_law_lines[below ? 2 : 3], distance, &of_hysteresis);
    *slope = *slope + direction * of_hysteresis;
    *slope = sticks ? *slope + hysteresis * NAME_PER_RADIUS : *slope;
    return force + direction * hysteresis;
//@ else
    (void)direction;
    (void)sticks;
    return force;
//@ end
}

//@ end
//@ if single
//@ if not periodic
/* Force and slope at a count outside the domain. */
static inline NAME_real NAME_law_far(int32_t count, NAME_real direction, int sticks, NAME_real *slope) {
    const int below = count < NAME_law_FIRST;
    const NAME_real distance =
        below ? (NAME_real)((uint32_t)NAME_law_FIRST - (uint32_t)count) - NAME_law_OFFSET_BELOW
              : (NAME_real)((uint32_t)count - (uint32_t)NAME_law_LAST) - NAME_law_OFFSET_ABOVE;
    return NAME_law_outside(distance, below, direction, sticks, slope);
}

//@ end
/* Force at a count. */
NAME_INLINE NAME_real NAME_law(int32_t count, NAME_real direction) {
    const NAME_real *c;
    NAME_real t;
    uint32_t k;
//@ if not periodic
    if ((uint32_t)count - (uint32_t)NAME_law_FIRST > (uint32_t)NAME_law_LAST - (uint32_t)NAME_law_FIRST) {
        return NAME_law_far(count, direction, 0, &t);
    }
//@ end
    c = NAME_law_cell(NAME_law_phase(count), &t, &k);
    return NAME_law_value(c, t, direction);
}

/* Force and slope at a count. */
NAME_INLINE NAME_real NAME_law_and_slope(int32_t count, NAME_real direction, int sticks, NAME_real *slope) {
    const NAME_real *c;
    NAME_real t;
    uint32_t k;
//@ if not periodic
    if ((uint32_t)count - (uint32_t)NAME_law_FIRST > (uint32_t)NAME_law_LAST - (uint32_t)NAME_law_FIRST) {
        return NAME_law_far(count, direction, sticks, slope);
    }
//@ end
    c = NAME_law_cell(NAME_law_phase(count), &t, &k);
    return NAME_law_slope(c, t, k, direction, sticks, slope);
}

//@ else
/* Force and slope at a position. */
static inline double NAME_law_at(double position, double direction, int sticks, double *slope) {
    double t;
    uint32_t cell, k;
//@ if periodic
    (void)NAME_law_wrapped(&position);
//@ else
    if (!(position >= NAME_law_LOWER && position <= NAME_law_UPPER)) {
        const int below = position < NAME_law_LOWER;
        const double distance = below ? NAME_law_LOWER - position : position - NAME_law_UPPER;
        return NAME_law_outside(distance, below, direction, sticks, slope);
    }
//@ end
    cell = NAME_law_cell_at(position, &t, &k);
    return NAME_law_slope(NAME_law_cells[cell], t, k, direction, sticks, slope);
}

//@ end
//@ end
//@ if memory
/* Force at rest at a place, its slope, and the ratio of the branches with its slope. */
typedef struct NAME_rest {
    NAME_real force, slope, ratio, ratio_slope;
} NAME_rest;

/* Values in a cell. */
NAME_INLINE NAME_rest NAME_rest_in(const NAME_real *c, NAME_real t, uint32_t k) {
    NAME_rest at;
    at.force = NAME_polynomial_slope(c, t, &at.slope);
    at.ratio = NAME_polynomial_slope(c + 6, t, &at.ratio_slope);
    at.slope = at.slope * NAME_law_per_width[k];
    at.ratio_slope = at.ratio_slope * NAME_law_per_width[k];
    return at;
}

/* Values at a distance outside the domain. */
static inline NAME_rest NAME_rest_outside(NAME_real distance, int below) {
    NAME_rest at;
    at.force = NAME_line(NAME_law_lines[below ? 0 : 1], distance, &at.slope);
    at.ratio = NAME_line(NAME_law_lines[below ? 2 : 3], distance, &at.ratio_slope);
    return at;
}

//@ if single
/* Values at a count. */
NAME_INLINE NAME_rest NAME_rest_at(int32_t count) {
    const NAME_real *c;
    NAME_real t;
    uint32_t k;
    if ((uint32_t)count - (uint32_t)NAME_law_FIRST > (uint32_t)NAME_law_LAST - (uint32_t)NAME_law_FIRST) {
        const int below = count < NAME_law_FIRST;
        const NAME_real distance =
            below ? (NAME_real)((uint32_t)NAME_law_FIRST - (uint32_t)count) - NAME_law_OFFSET_BELOW
                  : (NAME_real)((uint32_t)count - (uint32_t)NAME_law_LAST) - NAME_law_OFFSET_ABOVE;
        return NAME_rest_outside(distance, below);
    }
    c = NAME_law_cell(NAME_law_phase(count), &t, &k);
    return NAME_rest_in(c, t, k);
}
//@ else
/* Values at a position. */
NAME_INLINE NAME_rest NAME_rest_at(double position) {
    double t;
    uint32_t cell, k;
    if (!(position >= NAME_law_LOWER && position <= NAME_law_UPPER)) {
        const int below = position < NAME_law_LOWER;
        return NAME_rest_outside(below ? NAME_law_LOWER - position : position - NAME_law_UPPER, below);
    }
    cell = NAME_law_cell_at(position, &t, &k);
    return NAME_rest_in(NAME_law_cells[cell], t, k);
}
//@ end

//@ end
/* ------------------------------------------------------------------------- energy, in both precisions with doubles */

/* First and second antiderivative of one curve at a position of the domain. */
static inline void NAME_integrals_in_cell(double position, int curve, double *first, double *second) {
    double t, u, once, twice;
    uint32_t k;
    const uint32_t cell = NAME_law_cell_at(position, &t, &k);
    const NAME_real *c = NAME_law_cells[cell] + 6 * curve;
    const double *middle = NAME_law_integrals[cell] + 2 * curve;
    u = t * (NAME_law_COARSE_WIDTH / (double)(1u << k));
    once = (((((double)c[5] / 6.0 * t + (double)c[4] / 5.0) * t + (double)c[3] / 4.0) * t + (double)c[2] / 3.0) * t +
            (double)c[1] / 2.0) * t + (double)c[0];
    twice = (((((double)c[5] / 42.0 * t + (double)c[4] / 30.0) * t + (double)c[3] / 20.0) * t +
              (double)c[2] / 12.0) * t + (double)c[1] / 6.0) * t + (double)c[0] / 2.0;
    *first = middle[0] + u * once;
    *second = middle[1] + u * (middle[0] + u * twice);
}

/* First and second antiderivative of one curve at any position. */
static inline void NAME_integrals(double position, int curve, double *first, double *second) {
//@ if periodic
    const double turns = NAME_law_wrapped(&position);
    const double *a = NAME_law_ends[2 * curve];
    const double *b = NAME_law_ends[2 * curve + 1];
    const double period = NAME_law_UPPER - NAME_law_LOWER;
    const double along = position - NAME_law_LOWER;
    const double turn = b[3] - a[3];
    const double double_turn = b[4] - a[4] - a[3] * period;
    NAME_integrals_in_cell(position, curve, first, second);
    *first += turns * turn - a[3];
    *second += turns * (turn * along + double_turn + 0.5 * (turns - 1.0) * turn * period) - a[4] - a[3] * along;
//@ else
    if (!(position >= NAME_law_LOWER && position <= NAME_law_UPPER)) {
        const double *e = NAME_law_ends[2 * curve + (position < NAME_law_LOWER ? 0 : 1)];
        const double d = position - e[0];
        const double inside = d > e[5] ? e[5] : d < -e[5] ? -e[5] : d;
        *first = e[3] + (e[1] + 0.5 * e[2] * inside) * inside;
        *second = e[4] + (e[3] + (0.5 * e[1] + e[2] * (1.0 / 6.0) * inside) * inside) * inside +
                  *first * (d - inside);
    } else {
        NAME_integrals_in_cell(position, curve, first, second);
    }
//@ end
}

//@ if not memory
/* Energy at a position, after a motion that starts with the play operator at `before`. */
static inline NAME_real NAME_energy_from(double before, double position) {
    double mean, second;
//@ if hysteretic
    const double play = NAME_play(position, before);
    double first, at_play, unused;
    NAME_integrals(position, 0, &mean, &second);
    NAME_integrals(play, 1, &unused, &at_play);
    NAME_integrals(position, 1, &first, &second);
    return (NAME_real)(mean + ((position - play) * first - (second - at_play)) / NAME_PLAY_RADIUS);
//@ else
    (void)before;
    NAME_integrals(position, 0, &mean, &second);
    return (NAME_real)mean;
//@ end
}

//@ end
/* ------------------------------------------------------------------------------------------------ public functions */

//@ if memory
/* A number between -largest and largest. */
NAME_INLINE double NAME_within(double value, double largest) {
    return value > largest ? largest : value < -largest ? -largest : value;
}

/* Moves the branches by one tick to a position, and returns the force there and its slope. If the force would exceed
   the force limit, or would pull a tool that can leave the object, all stretches are reduced by one factor, which is
   0 while the tool is away. */
NAME_INLINE NAME_real NAME_relaxed(NAME_state *s, double position, NAME_rest at, NAME_real *slope) {
    const double rest = NAME_within((double)at.force, NAME_MOST_FORCE);
    const double least = NAME_CONTACT <= 0 ? -NAME_MOST_FORCE : rest < 0.0 ? rest : 0.0;
    const double most = NAME_CONTACT >= 0 ? NAME_MOST_FORCE : rest > 0.0 ? rest : 0.0;
    double coordinate, moved, stretch, unlimited, force, sum, stiffness = 0.0, factor = 1.0;
    int j;
    NAME_integrals(position, 1, &coordinate, &sum);
    moved = coordinate - s->coordinate;
    s->coordinate = coordinate;
    sum = 0.0;
    for (j = 0; j < NAME_BRANCHES; ++j) {
        stretch = NAME_kept[j] * (s->stretch[j] + moved);
        s->stretch[j] = NAME_within(stretch, NAME_most_stretch[j]);
        sum += NAME_stiffness[j] * s->stretch[j];
        if (stretch <= NAME_most_stretch[j] && stretch >= -NAME_most_stretch[j]) {
            stiffness += NAME_stiffness[j] * NAME_kept[j]; /* the branch does not slip */
        }
    }
    unlimited = rest + (double)at.ratio * sum;
    force = unlimited > most ? most : unlimited < least ? least : unlimited;
    if (force < unlimited || force > unlimited) {
        *slope = NAME_ZERO;
        factor = (force - rest) / (unlimited - rest);
        factor = factor < 0.0 ? 0.0 : factor > 1.0 ? 1.0 : factor;
    } else {
        *slope = (NAME_real)((double)at.slope + (double)at.ratio_slope * sum +
                             (double)at.ratio * (double)at.ratio * stiffness);
    }
    if (NAME_CONTACT != 0 && !(at.ratio < NAME_ZERO || at.ratio > NAME_ZERO)) {
        factor = 0.0; /* the tool is away from the object */
    }
    for (j = 0; j < NAME_BRANCHES; ++j) {
        s->stretch[j] *= factor;
    }
    return (NAME_real)force;
}

/* Stored energy of the object at rest at a position and of the branches. */
static inline NAME_real NAME_energy_of(const NAME_state *s, double position) {
    double energy, unused;
    int j;
    NAME_integrals(position, 0, &energy, &unused);
    for (j = 0; j < NAME_BRANCHES; ++j) {
        energy += 0.5 * NAME_stiffness[j] * s->stretch[j] * s->stretch[j];
    }
    return (NAME_real)energy;
}

/* Starts with the object at rest at this position. */
static inline void NAME_start_at(NAME_state *s, double position) {
    double unused;
    int j;
    NAME_integrals(position, 1, &s->coordinate, &unused);
    for (j = 0; j < NAME_BRANCHES; ++j) {
        s->stretch[j] = 0.0;
    }
}

//@ if not single
/* Moves the object by one tick to this position, and returns its force and slope. */
static inline double NAME_relax_at(NAME_state *s, double position, double *slope) {
    return NAME_relaxed(s, position, NAME_rest_at(position), slope);
}

/* Moves the object by one tick to this position. */
static inline void NAME_advance_at(NAME_state *s, double position) {
    double slope;
    (void)NAME_relax_at(s, position, &slope);
}

/* Force of the object and its slope after a tick to this position; does not change the state. */
static inline double NAME_force_slope_at(const NAME_state *s, double position, double *slope) {
    NAME_state moved = *s;
    return NAME_relax_at(&moved, position, slope);
}

/* Force of the object after a tick to this position; does not change the state. */
static inline double NAME_force_at(const NAME_state *s, double position) {
    double slope;
    return NAME_force_slope_at(s, position, &slope);
}

/* Stored energy after a tick to this position, plus a constant; does not change the state. */
static inline double NAME_energy_at(const NAME_state *s, double position) {
    NAME_state moved = *s;
    NAME_advance_at(&moved, position);
    return NAME_energy_of(&moved, position);
}

//@ end
/* Moves the object by one tick to this count, and returns its force and slope. */
NAME_INLINE NAME_real NAME_relax(NAME_state *s, int32_t count, NAME_real *slope) {
//@ if single
    return NAME_relaxed(s, (double)count * NAME_STEP, NAME_rest_at(count), slope);
//@ else
    return NAME_relax_at(s, (double)count * NAME_STEP, slope);
//@ end
}

/* Starts with the object at rest at this count. */
static inline void NAME_start(NAME_state *s, int32_t count) { NAME_start_at(s, (double)count * NAME_STEP); }

/* Moves the object by one tick to this count. */
static inline void NAME_advance(NAME_state *s, int32_t count) {
    NAME_real slope;
    (void)NAME_relax(s, count, &slope);
}

/* Force of the object and its slope after a tick to this count; does not change the state. */
static inline NAME_real NAME_force_slope(const NAME_state *s, int32_t count, NAME_real *slope) {
    NAME_state moved = *s;
    return NAME_relax(&moved, count, slope);
}

/* Force of the object after a tick to this count; does not change the state. */
static inline NAME_real NAME_force(const NAME_state *s, int32_t count) {
    NAME_real slope;
    return NAME_force_slope(s, count, &slope);
}

/* Stored energy after a tick to this count, plus a constant; does not change the state. */
static inline NAME_real NAME_energy(const NAME_state *s, int32_t count) {
    NAME_state moved = *s;
    NAME_advance(&moved, count);
    return NAME_energy_of(&moved, (double)count * NAME_STEP);
}

//@ else
//@ if not single
/* Starts with the object at rest at this position. */
static inline void NAME_start_at(NAME_state *s, double position) {
//@ if predicted
    uint32_t j;
    for (j = 0; j < NAME_TAPS; ++j) {
        s->past[j] = position;
    }
    s->oldest = 0;
//@ end
//@ if hysteretic
    s->play = position;
//@ end
//@ if massless
    s->lag = NAME_ZERO;
//@ end
//@ if stateless
    s->unused = 0;
//@ end
    (void)position;
}

/* Moves the play operator to this position. */
static inline void NAME_advance_at(NAME_state *s, double position) {
//@ if hysteretic
    s->play = NAME_play(position, s->play);
//@ else
    (void)s;
    (void)position;
//@ end
}

/* Force of the object and its slope at this position; does not change the state. */
static inline double NAME_force_slope_at(const NAME_state *s, double position, double *slope) {
//@ if hysteretic
    const double play = NAME_play(position, s->play);
    return NAME_law_at(position, (position - play) * NAME_PER_RADIUS, play == s->play, slope);
//@ else
    (void)s;
    return NAME_law_at(position, 0.0, 0, slope);
//@ end
}

/* Force of the object at this position; does not change the state. */
static inline double NAME_force_at(const NAME_state *s, double position) {
    double slope;
    return NAME_force_slope_at(s, position, &slope);
}

/* Stored energy at this position, plus a constant; does not change the state. */
static inline double NAME_energy_at(const NAME_state *s, double position) {
//@ if hysteretic
    return NAME_energy_from(s->play, position);
//@ else
    (void)s;
    return NAME_energy_from(0.0, position);
//@ end
}

//@ end
/* Starts with the object at rest at this count. */
static inline void NAME_start(NAME_state *s, int32_t count) {
//@ if single
//@ if predicted
    uint32_t j;
    for (j = 0; j < NAME_TAPS; ++j) {
        s->past[j] = count;
    }
    s->sum = NAME_TAPS * (uint32_t)count;
    s->oldest = 0;
//@ end
//@ if hysteretic
    s->anchor = count;
    s->side = NAME_ZERO;
//@ end
//@ if massless
    s->lag = NAME_ZERO;
//@ end
//@ if stateless
    s->unused = 0;
//@ end
    (void)count;
//@ else
    NAME_start_at(s, (double)count * NAME_STEP);
//@ end
}

/* Moves the play operator to this count. */
static inline void NAME_advance(NAME_state *s, int32_t count) {
//@ if single
    (void)NAME_moved(s, count);
//@ else
    NAME_advance_at(s, (double)count * NAME_STEP);
//@ end
}

/* Force of the object at this count; does not change the state. */
static inline NAME_real NAME_force(const NAME_state *s, int32_t count) {
//@ if single
    return NAME_law(count, NAME_unit(NAME_direction(s, count)));
//@ else
    return NAME_force_at(s, (double)count * NAME_STEP);
//@ end
}

/* Force of the object and its slope at this count; does not change the state. */
static inline NAME_real NAME_force_slope(const NAME_state *s, int32_t count, NAME_real *slope) {
//@ if single
    const NAME_real direction = NAME_direction(s, count);
    const int sticks = direction <= NAME_ONE && direction >= -NAME_ONE;
    return NAME_law_and_slope(count, NAME_unit(direction), sticks, slope);
//@ else
    return NAME_force_slope_at(s, (double)count * NAME_STEP, slope);
//@ end
}

/* Stored energy at this count, plus a constant; does not change the state. */
static inline NAME_real NAME_energy(const NAME_state *s, int32_t count) {
//@ if not single
    return NAME_energy_at(s, (double)count * NAME_STEP);
//@ end
//@ if single and hysteretic
    const double before = (double)s->anchor * NAME_STEP - (double)s->side * NAME_PLAY_RADIUS;
    return NAME_energy_from(before, (double)count * NAME_STEP);
//@ end
//@ if single and not hysteretic
    (void)s;
    return NAME_energy_from(0.0, (double)count * NAME_STEP);
//@ end
}

//@ end
/* ------------------------------------------------------------------------------------------- structure: STRUCTURE */

/* A force between the force limits of the device. */
NAME_INLINE NAME_real NAME_limited(NAME_real force) {
//@ if limited
    return force > NAME_FORCE_LIMIT ? NAME_FORCE_LIMIT : force < -NAME_FORCE_LIMIT ? -NAME_FORCE_LIMIT : force;
//@ else
    return force;
//@ end
}

//@ if between and not periodic
/* Counts beyond +-2^25 are held there, so that sums of differences fit into 32 bits. */
NAME_INLINE int32_t NAME_clamped(int32_t count) {
    return count > 33554432 ? 33554432 : count < -33554432 ? -33554432 : count;
}

//@ end
//@ if predicted and single
/* Predicts the position half a tick ahead from the last counts: a count, and a fraction of a count. */
NAME_INLINE int32_t NAME_predict(NAME_state *s, int32_t count, NAME_real *fraction) {
    const int32_t motion = (int32_t)(NAME_TAPS * (uint32_t)count - s->sum);
    const int32_t whole = motion / NAME_PARTS;
    *fraction = (NAME_real)(motion - whole * NAME_PARTS) * NAME_PER_PART;
    s->sum += (uint32_t)count - (uint32_t)s->past[s->oldest];
    s->past[s->oldest] = count;
    s->oldest = s->oldest + 1u == NAME_TAPS ? 0u : s->oldest + 1u;
    return (int32_t)((uint32_t)count + (uint32_t)whole);
}

//@ end
//@ if predicted and not single
/* Predicts the position half a tick ahead from the last positions. */
NAME_INLINE double NAME_predict(NAME_state *s, double position) {
    double motion = 0.0;
    uint32_t j;
    for (j = 0; j < NAME_TAPS; ++j) {
        motion += position - s->past[j];
    }
    s->past[s->oldest] = position;
    s->oldest = s->oldest + 1u == NAME_TAPS ? 0u : s->oldest + 1u;
    return position + motion * NAME_PER_PART;
}

//@ end
//@ if massless and single
/* Force of the massless object at a count plus a fraction of a count on the load line. */
NAME_INLINE NAME_real NAME_response(int32_t count, NAME_real fraction) {
    NAME_real distance, t;
    uint32_t phase, k;
    int below;
    if (NAME_response_find(count, fraction, &phase, &distance, &below)) {
        const NAME_real *c = NAME_response_cell(phase, &t, &k);
        return NAME_polynomial(c, t);
    }
//@ if periodic
    return NAME_ZERO; /* not reached: every position lies in a period */
//@ else
    return NAME_line(NAME_response_lines[below ? 0 : 1], distance, &t);
//@ end
}

//@ end
//@ if massless and not single
/* Force of the massless object at a position on the load line. */
NAME_INLINE double NAME_response(double position) {
    double t;
    uint32_t cell, k;
//@ if periodic
    (void)NAME_response_wrapped(&position);
//@ else
    if (!(position >= NAME_response_LOWER && position <= NAME_response_UPPER)) {
        const int below = position < NAME_response_LOWER;
        const double distance = below ? NAME_response_LOWER - position : position - NAME_response_UPPER;
        return NAME_line(NAME_response_lines[below ? 0 : 1], distance, &t);
    }
//@ end
    cell = NAME_response_cell_at(position, &t, &k);
    return NAME_polynomial(NAME_response_cells[cell], t);
}

//@ end
/* One tick: returns the force of the object, limited to the force of the device, and changes the state. */
static inline NAME_real NAME_step(NAME_state *s, int32_t count) {
//@ if memory
    NAME_real slope;
    return NAME_limited(NAME_relax(s, count, &slope));
//@ end
//@ if direct and single
    return NAME_limited(NAME_law(count, NAME_moved(s, count)));
//@ end
//@ if direct and not single
    NAME_advance(s, count);
    return NAME_limited(NAME_force(s, count));
//@ end
//@ if predicted and single
    NAME_real fraction, direction, distance, t;
    uint32_t phase, k;
    int32_t ahead;
    int below;
//@ if not periodic
    count = NAME_clamped(count);
//@ end
    ahead = NAME_predict(s, count, &fraction);
    direction = NAME_moved(s, count);
//@ if hysteretic
    direction = (NAME_real)(int32_t)((uint32_t)ahead - (uint32_t)s->anchor) + fraction;
    direction = NAME_unit(s->side + direction * NAME_PER_PLAY);
//@ end
    if (NAME_law_find(ahead, fraction, &phase, &distance, &below)) {
        const NAME_real *c = NAME_law_cell(phase, &t, &k);
        return NAME_limited(NAME_law_value(c, t, direction));
    }
//@ if periodic
    return NAME_ZERO; /* not reached: every position lies in a period */
//@ else
    return NAME_limited(NAME_law_outside(distance, below, direction, 0, &t));
//@ end
//@ end
//@ if predicted and not single
    const double position = (double)count * NAME_STEP;
    const double ahead = NAME_predict(s, position);
    NAME_advance_at(s, position);
    return NAME_limited(NAME_force_at(s, ahead));
//@ end
//@ if massless and single
    const NAME_real back = NAME_MEMORY * s->lag;
    const int32_t whole = (int32_t)back;
    NAME_real force;
//@ if not periodic
    count = NAME_clamped(count);
//@ end
    force = NAME_limited(NAME_response((int32_t)((uint32_t)count - (uint32_t)whole), (NAME_real)whole - back));
    s->lag = back + force * NAME_COMPLIANCE;
    return force;
//@ end
//@ if massless and not single
    const double back = NAME_MEMORY * s->lag;
    const double force = NAME_limited(NAME_response((double)count * NAME_STEP - back));
    s->lag = back + force * NAME_COMPLIANCE;
    return force;
//@ end
}

/* Force of the device in micronewton(metre)s for palpate_model: minus the force of the object, rounded. */
static inline int32_t NAME_torque_uNm(void *state, int32_t count) {
    const NAME_real torque = NAME_step((NAME_state *)state, count) * (NAME_real)-1000000;
    if (torque >= (NAME_real)2147483520) {
        return INT32_MAX;
    }
    if (torque <= (NAME_real)-2147483520) {
        return -INT32_MAX;
    }
    return (int32_t)(torque < NAME_ZERO ? torque - NAME_HALF : torque + NAME_HALF);
}

/* NAME_start for palpate_model. */
static inline void NAME_start_of(void *state, int32_t count) { NAME_start((NAME_state *)state, count); }
