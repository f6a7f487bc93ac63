/* SPDX-License-Identifier: Apache-2.0 */
/* Locks for Cortex-M: the interrupts are masked, and the previous mask is restored. */
#ifndef PALPATE_PORT_H
#define PALPATE_PORT_H

#include <stdint.h>

static inline uint32_t palpate_mask_interrupts(void) {
    uint32_t mask;
    __asm volatile("mrs %0, primask\n\tcpsid i" : "=r"(mask)::"memory");
    return mask;
}

static inline void palpate_restore_interrupts(uint32_t mask) {
    __asm volatile("msr primask, %0" ::"r"(mask) : "memory");
}

#define PALPATE_LOCK() const uint32_t palpate_interrupt_mask = palpate_mask_interrupts()
#define PALPATE_UNLOCK() palpate_restore_interrupts(palpate_interrupt_mask)

#endif
