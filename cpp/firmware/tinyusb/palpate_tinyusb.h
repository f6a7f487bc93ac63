/* SPDX-License-Identifier: Apache-2.0 */
/* Class driver for TinyUSB (0.16 to 0.19): connects its callbacks with a palpate_device. It was compiled against
 * declarations only and never tried on hardware. */
#ifndef PALPATE_TINYUSB_H
#define PALPATE_TINYUSB_H

#include <stdint.h>

#include "palpate_device.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The port supplies the device, started by palpate_device_start before tusb_init, and its clock. */
extern palpate_device palpate_usb_device;
uint32_t palpate_clock_us(void);

/* Interface and endpoints of the configuration descriptor, 23 bytes. `number` is that of the interface. */
#define PALPATE_INTERFACE_DESCRIPTOR(number)                                              \
    9, 4, (number), 0, 2, 0xFF, 1, 1, 0, /* interface: two endpoints, vendor class */     \
        7, 5, 0x81, 3, 64, 0, 1,         /* endpoint to the host: interrupt, each 1 ms */ \
        7, 5, 0x01, 3, 64, 0, 1          /* endpoint to the device */

#ifdef __cplusplus
}
#endif

#endif
