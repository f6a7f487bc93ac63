/* SPDX-License-Identifier: Apache-2.0 */
/* Start and output of a program on this computer, or on a Cortex-M of QEMU by semihosting. */
#ifndef PLATFORM_H
#define PLATFORM_H

#include <stdint.h>

int work(void);

#if defined(__arm__)

extern uint32_t stack_top, data_start, data_end, data_stored, bss_start, bss_end;
void reset(void);

static inline int32_t semihosting(int32_t operation, const void *argument) {
    register int32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static void print(const char *text) { (void)semihosting(4, text); }

void reset(void) {
    uint32_t *to, *from = &data_stored;
    *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20; /* switches the floating-point unit on */
    __asm__ volatile("dsb\n isb");
    for (to = &data_start; to < &data_end;) {
        *to++ = *from++;
    }
    for (to = &bss_start; to < &bss_end;) {
        *to++ = 0;
    }
    (void)work();
    (void)semihosting(0x18, (const void *)0x20026); /* the program has ended */
    for (;;) {
    }
}

__attribute__((section(".vectors"), used)) static void (*const vectors[2])(void) = {(void (*)(void))&stack_top, reset};

#else

#include <stdio.h>
static void print(const char *text) { fputs(text, stdout); }
int main(void) { return work(); }

#endif

/* Prints a number as 16 hexadecimal digits and a line break. */
static inline void print_number(uint64_t number) {
    char text[18];
    int k;
    for (k = 0; k < 16; ++k) {
        text[k] = "0123456789abcdef"[(number >> (60 - 4 * k)) & 15u];
    }
    text[16] = '\n';
    text[17] = 0;
    print(text);
}

#endif
