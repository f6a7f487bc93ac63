/* SPDX-License-Identifier: Apache-2.0 */
/* The declarations of TinyUSB's interface for class drivers, written for this test. */
#ifndef USBD_PVT_H
#define USBD_PVT_H

#include "tusb.h"

typedef struct {
    const char* name;
    void (*init)(void);
    bool (*deinit)(void);
    void (*reset)(uint8_t rhport);
    uint16_t (*open)(uint8_t rhport, const tusb_desc_interface_t* interface, uint16_t max_len);
    bool (*control_xfer_cb)(uint8_t rhport, uint8_t stage, const tusb_control_request_t* request);
    bool (*xfer_cb)(uint8_t rhport, uint8_t ep_addr, xfer_result_t result, uint32_t xferred_bytes);
    void (*sof)(uint8_t rhport, uint32_t frame_count);
} usbd_class_driver_t;

const usbd_class_driver_t* usbd_app_driver_get_cb(uint8_t* driver_count);
bool usbd_edpt_open(uint8_t rhport, const tusb_desc_endpoint_t* desc_ep);
bool usbd_edpt_xfer(uint8_t rhport, uint8_t ep_addr, uint8_t* buffer, uint16_t total_bytes);

#endif
