/* SPDX-License-Identifier: Apache-2.0 */
#include "palpate_device.h"

#include <string.h>

#ifndef PALPATE_LOCK
#include "palpate_port.h"
#endif

enum { VERSION = 1, SHORTEST_WATCHDOG_MS = 2, LONGEST_WATCHDOG_MS = 1000, LARGEST_AGE_US = 0xFFFF };

/* Control requests */
enum { GET_INFO = 1, ENABLE = 2, ZERO = 3, WATCHDOG = 4, CLEAR = 5, GET_MODEL = 6, RENDERER = 7 };
enum { REQUEST_TO_HOST = 0xC1, REQUEST_TO_DEVICE = 0x41 }; /* bmRequestType: vendor, interface */

static uint8_t* put(uint8_t* at, uint32_t value, int size) {
    for (; size > 0; --size) {
        *at++ = (uint8_t)value;
        value >>= 8;
    }
    return at;
}

static uint8_t* put64(uint8_t* at, uint64_t value) {
    return put(put(at, (uint32_t)value, 4), (uint32_t)(value >> 32), 4);
}

static uint32_t get(const uint8_t* at, int size) {
    uint32_t value = 0;
    while (size > 0) {
        value = value << 8 | at[--size];
    }
    return value;
}

/* Converts to a signed integer without the overflow that C leaves to the compiler. */
static int32_t to_signed(uint32_t bits) {
    return bits <= INT32_MAX ? (int32_t)bits : -(int32_t)~bits - 1;
}

static int32_t relative_count(const palpate_device* device) {
    return to_signed((uint32_t)device->sample.count - (uint32_t)device->zero);
}

/* Time since the last command. A command that is newer than the sample of the tick has the age 0. */
static uint32_t command_age_us(const palpate_device* device) {
    const uint32_t age = device->sample.clock_us - device->out_us;
    return age <= INT32_MAX ? age : 0;
}

/* Sets zero torque until the next command. */
static void release(palpate_device* device) {
    device->has_command = device->runs_model = false;
    device->torque_uNm = 0;
}

static int32_t limited(palpate_device* device, int32_t torque_uNm) {
    const int32_t most = device->properties->max_torque_uNm;
    device->status &= (uint16_t)~PALPATE_SATURATED;
    if (torque_uNm >= -most && torque_uNm <= most) {
        return torque_uNm;
    }
    device->status |= PALPATE_SATURATED;
    return torque_uNm > 0 ? most : -most;
}

static void run_watchdog(palpate_device* device) {
    const uint32_t age_us = command_age_us(device);
    const uint32_t life_ms = device->life_ms < device->watchdog_ms ? device->life_ms : device->watchdog_ms;
    if (device->was_commanded && age_us >= 1000 * life_ms) {
        device->status |= PALPATE_WATCHDOG;
        release(device);
        if (age_us > LARGEST_AGE_US) { /* the age does not return to 0 when the clock does */
            device->out_us = device->sample.clock_us - LARGEST_AGE_US;
        }
    }
}

static bool makes_torque(const palpate_device* device) {
    return device->has_command && (device->status & (PALPATE_ENABLED | PALPATE_FAULTS)) == PALPATE_ENABLED;
}

/* Returns the torque of the model; after its start it grows from zero. */
static int32_t ramped(palpate_device* device, int32_t torque_uNm, uint32_t passed_us) {
    const uint32_t whole_us = 1000U * device->properties->ramp_ms;
    if (device->ramp_us >= whole_us) {
        return torque_uNm;
    }
    device->ramp_us += passed_us;
    if (device->ramp_us >= whole_us) {
        return torque_uNm;
    }
    const uint32_t share =
        device->ramp_us / 16 * 4096 / (whole_us / 16); /* of 4096; at most 10 s fit 32 bits */
    return (int32_t)((int64_t)torque_uNm * (int32_t)share / 4096);
}

/* Plan for one tick. */
typedef struct tick {
    bool renders; /* the model computes the torque of this tick */
    bool starts;
    int32_t count;
    int32_t torque_uNm;
    uint32_t passed_us;
} tick;

/* First half of a tick: stores the sample and decides the torque, except that of the model. */
static tick begin_tick(palpate_device* device, const palpate_sample* sample) {
    tick plan;
    PALPATE_LOCK();
    plan.passed_us = sample->clock_us - device->sample.clock_us;
    device->sample = *sample;
    run_watchdog(device);
    const bool makes = makes_torque(device);
    plan.renders = makes && device->uses_model;
    plan.starts = !device->runs_model;
    plan.count = relative_count(device);
    device->runs_model = plan.renders;
    if (!plan.renders) {
        device->torque_uNm = makes ? device->command_uNm : 0;
    }
    plan.torque_uNm = device->torque_uNm;
    PALPATE_UNLOCK();
    return plan;
}

/* Second half of a tick with a model. An event since the first half has set runs_model to false and the torque to 0. */
static int32_t end_tick(palpate_device* device, int32_t torque_uNm, uint32_t passed_us) {
    PALPATE_LOCK();
    if (device->runs_model) {
        device->torque_uNm = ramped(device, limited(device, torque_uNm), passed_us);
    }
    torque_uNm = device->torque_uNm;
    PALPATE_UNLOCK();
    return torque_uNm;
}

void palpate_device_start(palpate_device* device, const palpate_properties* properties,
                          const palpate_model* model) {
    memset(device, 0, sizeof *device);
    device->properties = properties;
    device->model = model;
    device->watchdog_ms = properties->watchdog_ms;
}

int32_t palpate_device_tick(palpate_device* device, const palpate_sample* sample) {
    tick plan = begin_tick(device, sample);
    const palpate_model* model = device->model;
    if (!plan.renders) {
        return plan.torque_uNm;
    }
    if (plan.starts) {
        device->ramp_us = plan.passed_us = 0;
        model->start(model->state, plan.count);
    }
    return end_tick(device, model->torque_uNm(model->state, plan.count), plan.passed_us);
}

void palpate_device_out(palpate_device* device, const uint8_t* bytes, size_t size, uint32_t clock_us) {
    const bool valid =
        size == PALPATE_OUT_SIZE && bytes[0] == 'T' && bytes[1] == VERSION && get(bytes + 8, 2) == 0;
    PALPATE_LOCK();
    if (valid) {
        device->status &= (uint16_t)~(PALPATE_BAD_PACKET | PALPATE_WATCHDOG);
        device->out_sequence = (uint16_t)get(bytes + 2, 2);
        device->life_ms = (uint16_t)get(bytes + 10, 2);
        device->out_us = clock_us;
        device->was_commanded = device->has_command = true;
        if (!device->uses_model) {
            device->command_uNm = limited(device, to_signed(get(bytes + 4, 4)));
        }
    } else {
        device->status |= PALPATE_BAD_PACKET;
    }
    PALPATE_UNLOCK();
}

void palpate_device_in(palpate_device* device, uint8_t bytes[PALPATE_IN_SIZE]) {
    PALPATE_LOCK();
    const palpate_sample* sample = &device->sample;
    uint32_t age_us = command_age_us(device);
    if (!device->was_commanded || age_us > LARGEST_AGE_US) {
        age_us = LARGEST_AGE_US;
    }
    *bytes++ = 'H';
    *bytes++ = VERSION;
    bytes = put(bytes, ++device->sequence, 2);
    bytes = put(bytes, sample->clock_us, 4);
    bytes = put(bytes, (uint32_t)relative_count(device), 4);
    bytes = put(bytes, (uint32_t)sample->velocity_cps, 4);
    bytes = put(bytes, (uint32_t)device->torque_uNm, 4);
    bytes = put(bytes, device->status, 2);
    bytes = put(bytes, device->out_sequence, 2);
    bytes = put(bytes, age_us, 2);
    bytes = put(bytes, sample->temperature_dC, 2);
    put(bytes, (uint32_t)sample->sensor_uNm, 4);
    PALPATE_UNLOCK();
}

static int put_info(const palpate_device* device, uint8_t* answer) {
    const palpate_properties* is = device->properties;
    uint8_t* at = answer;
    *at++ = 'I';
    *at++ = VERSION;
    at = put(at, is->firmware, 2);
    at = put(at, is->counts_per_rev, 4);
    at = put(at, (uint32_t)is->max_torque_uNm, 4);
    at = put(at, is->rate_hz, 2);
    at = put(at, device->watchdog_ms, 2);
    at = put(at, is->capabilities, 4);
    *at++ = PALPATE_IN_SIZE;
    *at++ = PALPATE_OUT_SIZE;
    *at++ = 1; /* degrees of freedom */
    *at++ = 0;
    at = put64(at, is->uid);
    return (int)(at - answer);
}

static int put_model(const palpate_device* device, uint8_t* answer) {
    uint8_t* at = answer;
    if (!device->model) {
        return PALPATE_STALL;
    }
    at = put64(at, device->model->fingerprint);
    at = put64(at, device->model->certificate);
    at = put(at, device->model->rate_hz, 4);
    at = put(at, device->uses_model, 4);
    return (int)(at - answer);
}

/* The certificate of a model is valid only for its own rate and encoder. */
static bool can_render(const palpate_device* device) {
    const palpate_model* model = device->model;
    return model && model->rate_hz == device->properties->loop_hz &&
           model->counts_per_rev == device->properties->counts_per_rev;
}

/* Executes a request without an answer; the port has locked the device. */
static int execute(palpate_device* device, uint8_t request, uint16_t value) {
    switch (request) {
        case ENABLE:
            release(device);
            device->status &= (uint16_t)~PALPATE_ENABLED;
            if (value == 0) {
                device->uses_model = false;
            } else if (value > 1 || (device->status & PALPATE_EMERGENCY_STOP) != 0) {
                return PALPATE_STALL;
            } else {
                device->status |= PALPATE_ENABLED;
            }
            return 0;
        case ZERO:
            device->zero = device->sample.count;
            if (device->uses_model) {
                release(device);
            }
            return 0;
        case WATCHDOG:
            if (value < SHORTEST_WATCHDOG_MS || value > LONGEST_WATCHDOG_MS) {
                return PALPATE_STALL;
            }
            device->watchdog_ms = value;
            return 0;
        case CLEAR:
            release(device);
            device->status = (uint16_t)((device->status & ~PALPATE_FAULTS) | device->present);
            return 0;
        case RENDERER:
            if (value > 1 || (value == 1 && !can_render(device))) {
                return PALPATE_STALL;
            }
            release(device);
            device->uses_model = value == 1;
            return 0;
        default:
            return PALPATE_STALL;
    }
}

int palpate_device_control(palpate_device* device, const uint8_t setup[PALPATE_SETUP_SIZE],
                           uint8_t answer[PALPATE_ANSWER_SIZE]) {
    const uint32_t most = get(setup + 6, 2); /* the size that the host accepts */
    int size = PALPATE_STALL;
    PALPATE_LOCK();
    if (setup[0] == REQUEST_TO_HOST && setup[1] == GET_INFO) {
        size = put_info(device, answer);
    } else if (setup[0] == REQUEST_TO_HOST && setup[1] == GET_MODEL) {
        size = put_model(device, answer);
    } else if (setup[0] == REQUEST_TO_DEVICE && most == 0) {
        size = execute(device, setup[1], (uint16_t)get(setup + 2, 2));
    }
    PALPATE_UNLOCK();
    return size > (int)most ? (int)most : size;
}

void palpate_device_disarm(palpate_device* device) {
    PALPATE_LOCK();
    release(device);
    device->status &= (uint16_t)~PALPATE_ENABLED;
    device->uses_model = false;
    PALPATE_UNLOCK();
}

void palpate_device_fault(palpate_device* device, uint16_t present) {
    PALPATE_LOCK();
    device->present = present & PALPATE_FAULTS;
    if (device->present != 0) {
        release(device);
        device->status |= device->present;
    }
    if ((device->present & PALPATE_EMERGENCY_STOP) != 0) {
        device->status &= (uint16_t)~PALPATE_ENABLED;
    }
    PALPATE_UNLOCK();
}
