/* SPDX-License-Identifier: Apache-2.0 */
/* Calls one function of the device side CALLS times more than another program, so that the difference of the counted
 * instructions is its cost. The macro CASE chooses the function. */
#include "palpate_device.h"

enum { HOST_TICK, MODEL_TICK, RAMP_TICK, START_TICK, EXPIRED_TICK, OUT, IN };

static void start_model(void* state, int32_t count) {
    (void)state;
    (void)count;
}

static int32_t model_torque(void* state, int32_t count) {
    (void)state;
    return CASE == RAMP_TICK || CASE == START_TICK ? INT32_MIN
                                                   : count; /* the longest way through the limit */
}

static const palpate_properties properties = {
    1, 65536, 0, 5000000, 10000, 1000, 20, CASE == RAMP_TICK || CASE == START_TICK ? 10000 : 1, 1};
static const palpate_model model = {2, 3, 10000, 65536, start_model, model_torque, 0};
static palpate_device device;

static void request(uint8_t number, uint8_t value) {
    const uint8_t setup[PALPATE_SETUP_SIZE] = {0x41, number, value, 0, 0, 0, 0, 0};
    uint8_t answer[PALPATE_ANSWER_SIZE];
    palpate_device_control(&device, setup, answer);
}

int main(void) {
    static const uint8_t command[PALPATE_OUT_SIZE] = {'T', 1, 1,  0, 0x10, 0x27, 0, 0,
                                                      0,   0, 10, 0, 0,    0,    0, 0};
    uint8_t packet[PALPATE_IN_SIZE];
    palpate_sample sample = {0, 0, 0, 0, 250};
    palpate_device_start(&device, &properties, &model);
    request(7, CASE == MODEL_TICK || CASE == RAMP_TICK || CASE == START_TICK);
    request(2, 1);
    palpate_device_out(&device, command, sizeof command, 0);
    for (int32_t k = 0; k < CALLS; ++k) {
        switch (CASE) {
            case OUT:
                palpate_device_out(&device, command, sizeof command, 0);
                break;
            case IN:
                palpate_device_in(&device, packet);
                break;
            default:
                sample.clock_us += CASE == EXPIRED_TICK ? 1000000U : 1U;
                sample.count = k;
                device.runs_model &= CASE != START_TICK;
                palpate_device_tick(&device, &sample);
        }
    }
    return 0;
}
