/* SPDX-License-Identifier: Apache-2.0 */
/* A device whose USB stack and control interrupt are a program on the computer that runs QEMU. It reads requests of 80
 * bytes from the FIFO "requests" and writes answers of 48 bytes to the FIFO "answers", both in QEMU's folder. QEMU's
 * Cortex-M machines have no USB device controller.
 *
 *     request  u8 operation, u8 size, u16 0, u32 clock_us, 72 B data
 *     answer   i32 torque_uNm, u16 status, u16 out_sequence, i32 result, 36 B data
 *
 * All numbers are little endian, as in the memory of the processor.
 *
 * The device renders a spring, or with MODEL the model of a header that `palpate export --c` wrote: MODEL is the name
 * of the model, HEADER its file in quotes. */
#include <string.h>

#include "palpate_device.h"
#include "semihosting.h"

#ifdef MODEL
#include HEADER
#define JOINED_(first, second) first##second
#define JOINED(first, second) JOINED_(first, second)
#define OF_MODEL(name) JOINED(MODEL, name)
#endif

typedef struct request {
    uint8_t operation;
    uint8_t size;
    uint16_t zero;
    uint32_t clock_us;
    uint8_t data[72];
} request;

typedef struct answer {
    int32_t torque_uNm;
    uint16_t status;
    uint16_t out_sequence;
    int32_t result;
    uint8_t data[36];
} answer;

/* Data of the operation 'S': the properties, and a spring as model. */
typedef struct power_up {
    palpate_properties properties;
    uint64_t fingerprint;
    uint64_t certificate;
    int32_t torque_uNm_per_count; /* 0: no model */
} power_up;

static palpate_device device;
static power_up settings;

#ifdef MODEL

static OF_MODEL(_state) object;
static const palpate_model exported = {OF_MODEL(_FINGERPRINT),
                                       OF_MODEL(_CERTIFICATE_FINGERPRINT),
                                       OF_MODEL(_RATE_HZ),
                                       OF_MODEL(_COUNTS_PER_REV),
                                       OF_MODEL(_start_of),
                                       OF_MODEL(_torque_uNm),
                                       &object};

static const palpate_model* chosen_model(void) {
    return &exported;
}

#else

static palpate_model model;

static void start_spring(void* state, int32_t count) {
    (void)state;
    (void)count;
}

static int32_t spring_torque_uNm(void* state, int32_t count) {
    const power_up* spring = state;
    const int64_t torque_uNm = (int64_t)spring->torque_uNm_per_count * count;
    return torque_uNm > INT32_MAX ? INT32_MAX : torque_uNm < INT32_MIN ? INT32_MIN : (int32_t)torque_uNm;
}

static const palpate_model* chosen_model(void) {
    model.fingerprint = settings.fingerprint;
    model.certificate = settings.certificate;
    model.rate_hz = settings.properties.loop_hz;
    model.counts_per_rev = settings.properties.counts_per_rev;
    model.start = start_spring;
    model.torque_uNm = spring_torque_uNm;
    model.state = &settings;
    return settings.torque_uNm_per_count != 0 ? &model : 0;
}

#endif

static void start(const uint8_t* data) {
    memcpy(&settings, data, sizeof settings);
    palpate_device_start(&device, &settings.properties, chosen_model());
}

static int32_t execute(const request* asked, uint8_t* data) {
    palpate_sample sample = {0};
    uint16_t faults;
    switch (asked->operation) {
        case 'S':
            start(asked->data);
            return 0;
        case 'T':
            sample.clock_us = asked->clock_us;
            memcpy(&sample.count, asked->data, 14); /* count to temperature_dC */
            return palpate_device_tick(&device, &sample);
        case 'O':
            palpate_device_out(&device, asked->data, asked->size, asked->clock_us);
            return 0;
        case 'I':
            palpate_device_in(&device, data);
            return PALPATE_IN_SIZE;
        case 'C':
            return palpate_device_control(&device, asked->data, data);
        case 'D':
            palpate_device_disarm(&device);
            return 0;
        case 'F':
            memcpy(&faults, asked->data, sizeof faults);
            palpate_device_fault(&device, faults);
            return 0;
        default:
            return -1;
    }
}

int main(void) {
    const int32_t requests = semihosting_open("requests", SEMIHOSTING_READ_MODE);
    const int32_t answers = semihosting_open("answers", SEMIHOSTING_WRITE_MODE);
    static request asked;
    while (requests >= 0 && answers >= 0 && semihosting_read(requests, &asked, sizeof asked) == 0) {
        answer given = {0};
        given.result = execute(&asked, given.data);
        given.torque_uNm = device.torque_uNm;
        given.status = device.status;
        given.out_sequence = device.out_sequence;
        if (semihosting_write(answers, &given, sizeof given) != 0) {
            return 1;
        }
    }
    return 0; /* the other program has closed its FIFO */
}
