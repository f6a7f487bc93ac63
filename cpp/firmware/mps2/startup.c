/* SPDX-License-Identifier: Apache-2.0 */
/* Start-up of a Cortex-M4F or M7 on the MPS2 boards of QEMU (mps2-an386, mps2-an500). */
#include <stdint.h>

#include "semihosting.h"

int main(void);
void reset_handler(void);

/* Symbols of mps2.ld */
extern uint32_t stack_top, data_load, data_start, data_end, bss_start, bss_end;

static void fault_handler(void) {
    semihosting_exit(2);
}

typedef void (*handler)(void);

/* The first word is the stack pointer; the order of the others is that of the processor's exceptions. */
__attribute__((section(".vectors"), used)) static const struct {
    uint32_t* stack;
    handler handlers[15];
} vectors = {&stack_top,
             {reset_handler, fault_handler, fault_handler, fault_handler, fault_handler, fault_handler}};

void reset_handler(void) {
    *(volatile uint32_t*)0xE000ED88U |= 0xFU << 20; /* CPACR: enables the FPU before the first float */
    __asm volatile("dsb\n\tisb");
    const uint32_t* from = &data_load;
    for (uint32_t* to = &data_start; to < &data_end; ++to) {
        *to = *from++;
    }
    for (uint32_t* to = &bss_start; to < &bss_end; ++to) {
        *to = 0;
    }
    semihosting_exit((uint32_t)main());
}
