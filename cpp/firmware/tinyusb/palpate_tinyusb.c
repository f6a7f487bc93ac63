/* SPDX-License-Identifier: Apache-2.0 */
#include "palpate_tinyusb.h"

#include "device/usbd_pvt.h"
#include "tusb.h"

enum { IN_ENDPOINT = 0x81, OUT_ENDPOINT = 0x01, LARGEST_PACKET = 64, VENDOR_CLASS = 0xFF };

static uint8_t in_packet[LARGEST_PACKET];
static uint8_t out_packet[LARGEST_PACKET];
static uint8_t answer[PALPATE_ANSWER_SIZE];

/* A packet waits in the endpoint until the host reads it, so its sample is up to 1 ms old. Its clock states the age. */
static bool send_sample(uint8_t port) {
    palpate_device_in(&palpate_usb_device, in_packet);
    return usbd_edpt_xfer(port, IN_ENDPOINT, in_packet, PALPATE_IN_SIZE);
}

static bool receive_command(uint8_t port) {
    return usbd_edpt_xfer(port, OUT_ENDPOINT, out_packet, LARGEST_PACKET);
}

static void driver_init(void) {}

/* TinyUSB calls this function at a bus reset, at SET_CONFIGURATION and at a disconnection. */
static void driver_reset(uint8_t port) {
    (void)port;
    palpate_device_disarm(&palpate_usb_device);
}

/* Opens the interface after SET_CONFIGURATION. Returns the size of its descriptors, or 0 for another interface. */
static uint16_t driver_open(uint8_t port, const tusb_desc_interface_t* interface, uint16_t most) {
    const uint8_t* descriptor = (const uint8_t*)interface;
    uint16_t size = descriptor[0];
    palpate_device_disarm(&palpate_usb_device);
    if (interface->bInterfaceClass != VENDOR_CLASS || interface->bInterfaceSubClass != 1 ||
        interface->bInterfaceProtocol != 1) {
        return 0;
    }
    for (uint8_t k = 0; k < interface->bNumEndpoints && size < most; ++k) {
        if (!usbd_edpt_open(port, (const tusb_desc_endpoint_t*)(const void*)(descriptor + size))) {
            return 0;
        }
        size = (uint16_t)(size + descriptor[size]);
    }
    return send_sample(port) && receive_command(port) ? size : 0;
}

/* Returns false to refuse a request (STALL). */
static bool driver_control(uint8_t port, uint8_t stage, const tusb_control_request_t* request) {
    if (stage != CONTROL_STAGE_SETUP) {
        return true;
    }
    const int size = palpate_device_control(&palpate_usb_device, (const uint8_t*)request, answer);
    if (size < 0) {
        return false;
    }
    return size == 0 ? tud_control_status(port, request)
                     : tud_control_xfer(port, request, answer, (uint16_t)size);
}

static bool driver_transferred(uint8_t port, uint8_t endpoint, xfer_result_t result, uint32_t size) {
    if (endpoint == IN_ENDPOINT) {
        return send_sample(port);
    }
    if (result == XFER_RESULT_SUCCESS) {
        palpate_device_out(&palpate_usb_device, out_packet, size, palpate_clock_us());
    }
    return receive_command(port);
}

const usbd_class_driver_t* usbd_app_driver_get_cb(uint8_t* count) {
    static const usbd_class_driver_t driver = {.init = driver_init,
                                               .reset = driver_reset,
                                               .open = driver_open,
                                               .control_xfer_cb = driver_control,
                                               .xfer_cb = driver_transferred};
    *count = 1;
    return &driver;
}

void tud_umount_cb(void) {
    palpate_device_disarm(&palpate_usb_device);
}

void tud_suspend_cb(bool remote_wakeup_enabled) {
    (void)remote_wakeup_enabled;
    palpate_device_disarm(&palpate_usb_device);
}
