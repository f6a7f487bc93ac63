/* SPDX-License-Identifier: Apache-2.0 */
/* Plays TinyUSB and a host for the class driver: descriptors, requests, packets, reset, suspend and disconnection. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "device/usbd_pvt.h"
#include "palpate_port.h"
#include "palpate_tinyusb.h"

#define CHECK(fact)                                                     \
    do {                                                                \
        if (!(fact)) {                                                  \
            fprintf(stderr, "line %d: %s is false\n", __LINE__, #fact); \
            exit(1);                                                    \
        }                                                               \
    } while (0)

palpate_device palpate_usb_device;

static uint8_t *waiting_in, *waiting_out; /* buffers of the submitted transfers */
static int opened, answered, accepted;

void test_lock(void) {}
void test_unlock(void) {}
uint32_t palpate_clock_us(void) {
    return 0;
}

bool usbd_edpt_open(uint8_t port, const tusb_desc_endpoint_t* descriptor) {
    (void)port;
    CHECK(descriptor->bmAttributes == 3 && descriptor->bInterval == 1);
    ++opened;
    return true;
}

bool usbd_edpt_xfer(uint8_t port, uint8_t endpoint, uint8_t* buffer, uint16_t size) {
    (void)port;
    CHECK(size == (endpoint == 0x81 ? 32 : 64));
    *(endpoint == 0x81 ? &waiting_in : &waiting_out) = buffer;
    return true;
}

bool tud_control_xfer(uint8_t port, const tusb_control_request_t* request, void* buffer, uint16_t size) {
    (void)port, (void)request, (void)buffer;
    answered = size;
    return true;
}

bool tud_control_status(uint8_t port, const tusb_control_request_t* request) {
    (void)port, (void)request;
    ++accepted;
    return true;
}

static const usbd_class_driver_t* driver;

static bool request(uint8_t type, uint8_t number, uint16_t value, uint16_t length) {
    const tusb_control_request_t setup = {type, number, value, 0, length};
    return driver->control_xfer_cb(0, CONTROL_STAGE_SETUP, &setup);
}

static int32_t tick(void) {
    const palpate_sample sample = {0, 0, 0, 0, 0};
    return palpate_device_tick(&palpate_usb_device, &sample);
}

static void make_force(void) {
    const uint8_t command[16] = {'T', 1, 1, 0, 0xE8, 3, 0, 0, 0, 0, 10, 0, 0, 0, 0, 0};
    CHECK(request(0x41, 2, 1, 0));
    memcpy(waiting_out, command, sizeof command);
    CHECK(driver->xfer_cb(0, 0x01, XFER_RESULT_SUCCESS, sizeof command));
    CHECK(tick() == 1000);
}

int main(void) {
    static const palpate_properties properties = {1, 65536, 0, 5000000, 10000, 1000, 20, 0, 1};
    static const uint8_t descriptor[] = {PALPATE_INTERFACE_DESCRIPTOR(0)};
    static const uint8_t foreign[] = {9, 4, 1, 0, 0, 0xFE, 1, 1, 0};
    uint8_t count = 0;
    palpate_device_start(&palpate_usb_device, &properties, 0);
    driver = usbd_app_driver_get_cb(&count);
    CHECK(count == 1);
    driver->init();
    CHECK(driver->open(0, (const tusb_desc_interface_t*)(const void*)foreign, sizeof foreign) == 0);
    CHECK(driver->open(0, (const tusb_desc_interface_t*)(const void*)descriptor, sizeof descriptor) ==
          sizeof descriptor);
    CHECK(opened == 2 && waiting_in && waiting_out);
    CHECK(waiting_in[0] == 'H' && waiting_in[2] == 1);
    CHECK(driver->xfer_cb(0, 0x81, XFER_RESULT_SUCCESS, 32));
    CHECK(waiting_in[2] == 2);
    CHECK(request(0xC1, 1, 0, 64) && answered == 32);
    CHECK(!request(0x41, 4, 1, 0) && !request(0xC1, 6, 0, 64));
    CHECK(driver->control_xfer_cb(0, CONTROL_STAGE_ACK, 0));
    make_force();
    CHECK(accepted == 1);
    driver->reset(0);
    CHECK(tick() == 0);
    make_force();
    tud_umount_cb();
    CHECK(tick() == 0);
    make_force();
    tud_suspend_cb(false);
    CHECK(tick() == 0);
    make_force();
    driver->open(0, (const tusb_desc_interface_t*)(const void*)descriptor, sizeof descriptor);
    CHECK(tick() == 0);
    return 0;
}
