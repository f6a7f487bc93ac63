/* SPDX-License-Identifier: Apache-2.0 */
/* Files and exit of a program in QEMU, by semihosting (option -semihosting-config enable=on,target=native). */
#ifndef SEMIHOSTING_H
#define SEMIHOSTING_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

static inline int32_t semihosting(int32_t operation, const void* arguments) {
    register int32_t r0 __asm("r0") = operation;
    register const void* r1 __asm("r1") = arguments;
    __asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

enum { SEMIHOSTING_READ_MODE = 1, SEMIHOSTING_WRITE_MODE = 5 }; /* "rb", "wb" */

/* Opens a file of the computer that runs QEMU; returns -1 on failure. */
static inline int32_t semihosting_open(const char* name, uint32_t mode) {
    const uintptr_t arguments[3] = {(uintptr_t)name, mode, strlen(name)};
    return semihosting(0x01, arguments);
}

/* Returns the number of bytes that were not written. */
static inline int32_t semihosting_write(int32_t file, const void* bytes, size_t size) {
    const uintptr_t arguments[3] = {(uintptr_t)file, (uintptr_t)bytes, size};
    return semihosting(0x05, arguments);
}

/* Returns the number of bytes that were not read. */
static inline int32_t semihosting_read(int32_t file, void* bytes, size_t size) {
    const uintptr_t arguments[3] = {(uintptr_t)file, (uintptr_t)bytes, size};
    return semihosting(0x06, arguments);
}

/* Ends QEMU with this exit code. */
static inline void semihosting_exit(uint32_t code) {
    const uint32_t arguments[2] = {0x20026, code}; /* reason: the application has ended */
    semihosting(0x20, arguments);
}

#endif
