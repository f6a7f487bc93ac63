// SPDX-License-Identifier: Apache-2.0
// Makes a race of setenv() with getenv() visible (LD_PRELOAD): setenv() moves the environment and makes the old one
// unreadable, and getenv() in another thread reads it slowly. Both are permitted by POSIX.
#define _GNU_SOURCE
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

enum { bytes = 1 << 16 };

char* getenv(const char* name) {
    const size_t length = strlen(name);
    char** entry = *(char** volatile*)&environ;
    if (syscall(SYS_gettid) != getpid()) {
        usleep(100000);
    }
    for (; entry != NULL && *entry != NULL; ++entry) {
        if (strncmp(*entry, name, length) == 0 && (*entry)[length] == '=') {
            return *entry + length + 1;
        }
    }
    return NULL;
}

int setenv(const char* name, const char* value, int overwrite) {
    static char** last;
    const size_t length = strlen(name);
    char** moved = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    size_t count = 0;
    (void)overwrite;
    if (last != NULL) {
        usleep(20000);  // other threads begin to read
    }
    moved[count] = malloc(length + strlen(value) + 2);
    strcat(strcat(strcpy(moved[count++], name), "="), value);
    for (char** entry = environ; entry != NULL && *entry != NULL; ++entry) {
        if (strncmp(*entry, name, length) != 0 || (*entry)[length] != '=') {
            moved[count++] = *entry;
        }
    }
    environ = moved;
    if (last != NULL) {
        mprotect(last, bytes, PROT_NONE);
    }
    last = moved;
    return 0;
}
