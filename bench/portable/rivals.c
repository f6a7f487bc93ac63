/* SPDX-License-Identifier: Apache-2.0 */
/* Rivals of an exported model: the sum of all wavelets with floats and expf, and hand-written detents. Prints the bits
   of their forces along counts. rivals.h defines the network (N, alpha, beta, weight, LINEAR, BIAS), STEP, and the
   counts FIRST to LAST. */
#include "rivals.h"
#include "platform.h"

#include <math.h>
#include <string.h>

__attribute__((noinline)) float measure_sum(int32_t count);
__attribute__((noinline)) float measure_detents(int32_t count, int32_t before);
__attribute__((noinline)) void run(void);

float measure_sum(int32_t count) {
    const float x = (float)count * STEP;
    float force = LINEAR * x + BIAS;
    int k;
    for (k = 0; k < N; ++k) {
        const float u = alpha[k] * (x - beta[k]);
        const float square = u * u;
        force += weight[k] * (square - 1.0f) * expf(-0.5f * square);
    }
    return force;
}

/* Force of detents with a dead zone, end stops and damping, as in open firmware of haptic knobs. */
float measure_detents(int32_t count, int32_t before) {
    const float x = (float)count * STEP;
    const float speed = (float)(count - before) * (STEP * 1000.0f);
    const float place = x * (1.0f / WIDTH);
    const float nearest = (float)(int32_t)(place < 0.0f ? place - 0.5f : place + 0.5f);
    const float last = (float)(DETENTS - 1);
    float distance, force;
    if (nearest < 0.0f || nearest > last) { /* end stops */
        distance = nearest < 0.0f ? x : x - last * WIDTH;
        force = 4.0f * STIFFNESS * distance;
    } else {
        distance = x - nearest * WIDTH;
        distance = distance > DEAD_ZONE ? distance - DEAD_ZONE : distance < -DEAD_ZONE ? distance + DEAD_ZONE : 0.0f;
        force = STIFFNESS * distance;
    }
    force += DAMPING * speed;
    return force > LIMIT ? LIMIT : force < -LIMIT ? -LIMIT : force;
}

static void print_float(float number) {
    uint32_t bits;
    memcpy(&bits, &number, sizeof bits);
    print_number(bits);
}

void run(void) {
    int32_t count, before = FIRST;
    for (count = FIRST; count <= LAST; count += EVERY) {
        print_float(measure_sum(count));
        print_float(measure_detents(count, before));
        before = count;
    }
}

int work(void) {
    run();
    return 0;
}
