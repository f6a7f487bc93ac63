/* SPDX-License-Identifier: Apache-2.0 */
/* Runs an exported model over a random motion and prints a hash of the bits of its results. The functions that begin
   with measure_ are counted by count_instructions.c. Compile with -DMODEL='"knob.h"' -DNAME=knob. */
#include MODEL
#include "platform.h"

#include <string.h>

#define JOIN_(a, b) a##_##b
#define JOIN(a, b) JOIN_(a, b)
#define F(function) JOIN(NAME, function)
typedef F(real) real;
typedef F(state) state;

__attribute__((noinline)) real measure_force(const state *s, int32_t count);
__attribute__((noinline)) real measure_force_slope(const state *s, int32_t count, real *slope);
__attribute__((noinline)) real measure_step(state *s, int32_t count);
__attribute__((noinline)) int32_t measure_torque(state *s, int32_t count);
__attribute__((noinline)) void run(void);

real measure_force(const state *s, int32_t count) { return F(force)(s, count); }
real measure_force_slope(const state *s, int32_t count, real *slope) { return F(force_slope)(s, count, slope); }
real measure_step(state *s, int32_t count) { return F(step)(s, count); }
int32_t measure_torque(state *s, int32_t count) { return F(torque_uNm)(s, count); }

#ifndef TICKS
#define TICKS 2000
#endif

static uint64_t hash = 0xCBF29CE484222325u;

__attribute__((noinline)) static void add(const void *bytes, uint32_t size) {
    const unsigned char *byte = (const unsigned char *)bytes;
    uint32_t k;
    for (k = 0; k < size; ++k) {
        hash = (hash ^ byte[k]) * 0x100000001B3u;
    }
}

static uint32_t seed = 1;
__attribute__((noinline)) static uint32_t next_random(void) {
    seed = seed * 1664525u + 1013904223u;
    return seed >> 8;
}

/* Returns the next count: a random motion over somewhat more than the domain, sometimes a count anywhere. */
__attribute__((noinline)) static int32_t next_count(int32_t count) {
    const int32_t first = (int32_t)(F(law_LOWER) / F(STEP));
    const int32_t travel = (int32_t)((F(law_UPPER) - F(law_LOWER)) / F(STEP));
    const uint32_t kind = next_random() % 64u;
#ifndef INSIDE
    if (kind == 0u) {
        return (int32_t)(next_random() << 8);
    }
    if (kind < 4u) {
        return first - travel / 4 + (int32_t)(next_random() % (uint32_t)(travel + travel / 2));
    }
#endif
    count += (int32_t)(next_random() % (uint32_t)(travel / 32 + 3)) - (travel / 32 + 3) / 2;
    count = count < first + 1 ? first + 1 : count;
    return count > first + travel - 1 ? first + travel - 1 : count;
}

void run(void) {
    state s;
    int32_t count = (int32_t)(0.5 * (F(law_LOWER) + F(law_UPPER)) / F(STEP));
    int k;
    F(start)(&s, count);
    for (k = 0; k < TICKS; ++k) {
        real force, slope, energy, step;
        int32_t torque;
        count = next_count(count);
        force = measure_force(&s, count);
        add(&force, sizeof force);
        force = measure_force_slope(&s, count, &slope);
        add(&force, sizeof force);
        add(&slope, sizeof slope);
        energy = F(energy)(&s, count);
        add(&energy, sizeof energy);
        step = measure_step(&s, count);
        add(&step, sizeof step);
        torque = measure_torque(&s, count);
        add(&torque, sizeof torque);
    }
}

int work(void) {
    run();
    print_number(hash);
    return 0;
}
