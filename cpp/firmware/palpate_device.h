/* SPDX-License-Identifier: Apache-2.0 */
/* Device side of palpate's USB protocol, version 1: packets, control requests, watchdog, faults, and a model that the
 * device can render itself. C99 and C++11, without heap, libm and operating system.
 *
 * The port calls these functions from its interrupts; docs/how-to/firmware.md shows a complete port. The port also
 * supplies a header palpate_port.h, which defines PALPATE_LOCK() and PALPATE_UNLOCK(). Between these two calls no other
 * function of the same device may run. PALPATE_LOCK() may declare a variable for the previous interrupt mask.
 * palpate_device_start is called before the interrupts are enabled.
 *
 * Signs: a torque > 0 accelerates the handle towards larger counts. */
#ifndef PALPATE_DEVICE_H
#define PALPATE_DEVICE_H

#include <stddef.h>
#include <stdint.h>
#ifndef __cplusplus
#include <stdbool.h>
#endif

#ifdef __cplusplus
extern "C" {
#endif

enum {
    PALPATE_IN_SIZE = 32,     /* packet to the host [bytes] */
    PALPATE_OUT_SIZE = 16,    /* packet from the host [bytes] */
    PALPATE_SETUP_SIZE = 8,   /* setup packet of a control request [bytes] */
    PALPATE_ANSWER_SIZE = 32, /* longest answer to a control request [bytes] */
    PALPATE_STALL = -1        /* palpate_device_control: the device refuses the request */
};

/* Bits of palpate_device.status */
enum {
    PALPATE_ENABLED = 1,
    PALPATE_WATCHDOG = 2, /* no command arrived in time */
    PALPATE_SATURATED = 4,
    PALPATE_BAD_PACKET = 8,
    PALPATE_ENCODER_FAULT = 16,
    PALPATE_OVER_TEMPERATURE = 32,
    PALPATE_EMERGENCY_STOP = 64,
    PALPATE_FAULTS = PALPATE_ENCODER_FAULT | PALPATE_OVER_TEMPERATURE | PALPATE_EMERGENCY_STOP
};

/* Bits of palpate_properties.capabilities */
enum { PALPATE_HAS_TRANSDUCER = 1, PALPATE_MEASURES_VELOCITY = 2 };

/* A model that the device renders, made from the header that `palpate export --c` writes. */
typedef struct palpate_model {
    uint64_t fingerprint; /* of the model */
    uint64_t certificate; /* fingerprint of the certificate of its plan */
    uint32_t rate_hz;     /* certified rate of the control loop */
    uint32_t counts_per_rev;
    void (*start)(void* state, int32_t count);         /* object at rest at this position */
    int32_t (*torque_uNm)(void* state, int32_t count); /* torque of this tick */
    void* state;
} palpate_model;

/* Properties of the device, which do not change. */
typedef struct palpate_properties {
    uint64_t uid;
    uint32_t counts_per_rev;
    uint32_t capabilities;
    int32_t max_torque_uNm; /* largest torque, > 0 */
    uint32_t loop_hz;       /* calls of palpate_device_tick a second */
    uint16_t rate_hz;       /* packets to the host a second */
    uint16_t watchdog_ms;   /* watchdog time after power-up, 2 to 1000 */
    uint16_t ramp_ms;       /* time in which the torque of the model grows from zero, at most 10000 */
    uint16_t firmware;      /* version of the firmware */
} palpate_properties;

/* Readings of the sensors in one tick. */
typedef struct palpate_sample {
    uint32_t clock_us; /* clock of the device when the encoder was read; 0 again after 71 minutes */
    int32_t count;     /* encoder count, without the zero that the host sets */
    int32_t velocity_cps;
    int32_t sensor_uNm;      /* torque of the transducer; 0 without one */
    uint16_t temperature_dC; /* 0.1 degrees Celsius */
} palpate_sample;

/* State of one device. The port calls the functions below and changes no member. */
typedef struct palpate_device {
    const palpate_properties* properties;
    const palpate_model* model; /* 0: the device has no model */
    palpate_sample sample;      /* sample of the last tick */
    int32_t zero;               /* encoder count at position 0 */
    int32_t command_uNm;        /* torque of the last command */
    int32_t torque_uNm;         /* torque of the motor now */
    uint32_t out_us;            /* time of the last command */
    uint32_t ramp_us;           /* time since the model started */
    uint16_t status;
    uint16_t present; /* faults that are present now */
    uint16_t watchdog_ms;
    uint16_t life_ms; /* time to live of the last command */
    uint16_t sequence;
    uint16_t out_sequence;
    bool was_commanded; /* a command has arrived since power-up */
    bool has_command; /* a command is in force: neither expired nor ended by an event that sets zero torque */
    bool uses_model;  /* renderer: the model of the device, not the host */
    bool runs_model;  /* the model has started and is rendered */
} palpate_device;

/* Sets the state after power-up: disabled, zero torque. `model` may be 0. Properties and model must remain valid. */
void palpate_device_start(palpate_device* device, const palpate_properties* properties,
                          const palpate_model* model);

/* Runs one tick of the control interrupt. Returns the torque for the motor until the next tick [uN*m]. */
int32_t palpate_device_tick(palpate_device* device, const palpate_sample* sample);

/* Takes a packet from the OUT endpoint that arrived at the time `clock_us`. */
void palpate_device_out(palpate_device* device, const uint8_t* bytes, size_t size, uint32_t clock_us);

/* Writes the next packet for the IN endpoint: the sample of the last tick. */
void palpate_device_in(palpate_device* device, uint8_t bytes[PALPATE_IN_SIZE]);

/* Executes a control request to the interface (vendor requests only). Returns the size of the answer, 0 for a request
 * without an answer, or PALPATE_STALL. */
int palpate_device_control(palpate_device* device, const uint8_t setup[PALPATE_SETUP_SIZE],
                           uint8_t answer[PALPATE_ANSWER_SIZE]);

/* Sets zero torque and disables the motor: call it at bus reset, suspend, SET_CONFIGURATION and disconnection. */
void palpate_device_disarm(palpate_device* device);

/* States the faults that are present now, as bits of PALPATE_FAULTS. A fault sets zero torque. It remains in the status
 * until it is no longer present and the host has sent CLEAR. */
void palpate_device_fault(palpate_device* device, uint16_t present);

#ifdef __cplusplus
}
#endif

#endif
