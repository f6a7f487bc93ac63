// SPDX-License-Identifier: Apache-2.0
// A library for LD_PRELOAD. It counts the calls with which a program changes files below one folder. At a chosen call it
// ends the program, or lets the call fail. Before every call it can store a copy of the folder: a program that ends
// there leaves these files. file_faults.py uses it.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <spawn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static struct {
    char folder[PATH_MAX];  // calls for files below this folder are counted; empty: none
    char log[PATH_MAX];     // one line for each call: its name and its file
    char states[PATH_MAX];  // copies of the folder; empty: none
    char only[32];          // calls with this name fail; empty: all
    long kill_at;           // number of the call before which the program ends; 0: none
    long fail_at;           // number of the call that fails; 0: none; -1: all
    int error;              // error number of a failed call
    long calls;
    long writes_in_a_row;
} plan;

static long clock_step_s;  // the system time jumps by this at every reading; 0: it does not

void arm_file_faults(const char* folder, const char* log, const char* states, const char* only, long kill_at,
                     long fail_at, int error) {
    snprintf(plan.log, sizeof plan.log, "%s", log);
    snprintf(plan.states, sizeof plan.states, "%s", states);
    snprintf(plan.only, sizeof plan.only, "%s", only);
    plan.kill_at = kill_at;
    plan.fail_at = fail_at;
    plan.error = error;
    plan.calls = 0;
    snprintf(plan.folder, sizeof plan.folder, "%s", folder);
}

static const char* variable(const char* name) {
    const char* value = getenv(name);
    return value == NULL ? "" : value;
}

__attribute__((constructor)) static void arm_from_environment(void) {
    clock_step_s = atol(variable("FILE_FAULTS_CLOCK_STEP_S"));
    arm_file_faults(variable("FILE_FAULTS_FOLDER"), variable("FILE_FAULTS_LOG"), variable("FILE_FAULTS_STATES"),
                    variable("FILE_FAULTS_ONLY"), atol(variable("FILE_FAULTS_KILL_AT")),
                    atol(variable("FILE_FAULTS_FAIL_AT")), atoi(variable("FILE_FAULTS_ERROR")));
}

enum { most_writes_in_a_row = 3 };  // of the writes of a long file, copies are stored before the first ones only

static void store_state(long call, const char* moment) {
    char copy[PATH_MAX + 64];
    snprintf(copy, sizeof copy, "%s/%03ld-%s", plan.states, call, moment);
    char* const command[] = {"cp", "-a", plan.folder, copy, NULL};
    char* const environment[] = {"PATH=/usr/bin:/bin", NULL};
    pid_t child;
    if (posix_spawnp(&child, "cp", NULL, NULL, command, environment) == 0) {
        waitpid(child, NULL, 0);
    }
}

// Returns the path of an open file or folder; AT_FDCWD is the working folder.
static const char* path_of(int file, char path[PATH_MAX]) {
    char place[64];
    const int saved = errno;
    snprintf(place, sizeof place, file == AT_FDCWD ? "/proc/self/cwd" : "/proc/self/fd/%d", file);
    const ssize_t length = readlink(place, path, PATH_MAX - 1);
    errno = saved;
    path[length > 0 ? length : 0] = 0;
    return path;
}

// Returns the number of a call for a file below the folder, 0 for another file, and -1 if the call must fail.
static long reached_in(const char* name, int base, const char* path) {
    if (plan.folder[0] == 0) {
        return 0;
    }
    char full[2 * PATH_MAX];
    char start[PATH_MAX];
    if (path[0] == '/') {
        snprintf(full, sizeof full, "%s", path);
    } else {
        snprintf(full, sizeof full, "%s/%s", path_of(base, start), path);
    }
    const size_t length = strlen(plan.folder);
    if (strncmp(full, plan.folder, length) != 0 || (full[length] != '/' && full[length] != 0)) {
        return 0;
    }
    const long call = __atomic_add_fetch(&plan.calls, 1, __ATOMIC_SEQ_CST);
    char line[2 * PATH_MAX + 64];
    const int size = snprintf(line, sizeof line, "%s %s\n", name, full + length);
    const int log = (int)syscall(SYS_openat, AT_FDCWD, plan.log, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    (void)!syscall(SYS_write, log, line, (size_t)size);
    syscall(SYS_close, log);
    plan.writes_in_a_row = strcmp(name, "write") == 0 ? plan.writes_in_a_row + 1 : 0;
    if (plan.states[0] != 0 && plan.writes_in_a_row <= most_writes_in_a_row) {
        store_state(call, name);
    }
    if (call == plan.kill_at) {
        kill(getpid(), SIGKILL);
        pause();
    }
    if ((plan.fail_at == call || plan.fail_at == -1) && (plan.only[0] == 0 || strcmp(plan.only, name) == 0)) {
        errno = plan.error;
        return -1;
    }
    return call;
}

static long reached(const char* name, const char* path) {
    return reached_in(name, AT_FDCWD, path);
}

static long reached_file(const char* name, int file) {
    char path[PATH_MAX];
    return plan.folder[0] != 0 && path_of(file, path)[0] == '/' ? reached(name, path) : 0;
}

#define NEXT(function, ...) \
    static __typeof__(&function) next; \
    if (next == NULL) { \
        next = (__typeof__(&function))dlsym(RTLD_NEXT, #function); \
    } \
    return next(__VA_ARGS__)

#define CALL(name, base, path, function, ...) \
    { \
        if (reached_in(name, base, path) < 0) { \
            return -1; \
        } \
        NEXT(function, __VA_ARGS__); \
    }
#define FILE_CALL(name, file, function, ...) \
    { \
        if (reached_file(name, file) < 0) { \
            return -1; \
        } \
        NEXT(function, __VA_ARGS__); \
    }

static int changes(int flags) {
    return (flags & (O_CREAT | O_TRUNC)) != 0 || (flags & O_TMPFILE) == O_TMPFILE;
}

// The new file keeps to O_EXCL and O_NOFOLLOW, so the name of the call shows if one of them is missing.
static const char* name_of_open(int flags) {
    if ((flags & O_TMPFILE) == O_TMPFILE) {
        return "open-nameless";
    }
    return (flags & (O_CREAT | O_EXCL | O_NOFOLLOW)) == (O_CREAT | O_EXCL | O_NOFOLLOW) ? "open-new" : "open";
}

#define OPEN(function, base, path, ...) \
    { \
        va_list more; \
        va_start(more, flags); \
        const mode_t mode = (flags & O_CREAT) != 0 || (flags & O_TMPFILE) == O_TMPFILE ? va_arg(more, mode_t) : 0; \
        va_end(more); \
        if (changes(flags) && reached_in(name_of_open(flags), base, path) < 0) { \
            return -1; \
        } \
        NEXT(function, __VA_ARGS__, flags, mode); \
    }

int open(const char* path, int flags, ...) OPEN(open, AT_FDCWD, path, path)
int open64(const char* path, int flags, ...) OPEN(open64, AT_FDCWD, path, path)
int openat(int folder, const char* path, int flags, ...) OPEN(openat, folder, path, folder, path)
int openat64(int folder, const char* path, int flags, ...) OPEN(openat64, folder, path, folder, path)

// With copies, every second write writes only half of its bytes, as on a full disk, so that a copy contains an
// incomplete text. The program then calls again for the rest.
ssize_t write(int file, const void* bytes, size_t size) {
    static int is_rest;
    const long call = reached_file("write", file);
    if (call < 0) {
        return -1;
    }
    is_rest = !is_rest && call > 0 && size > 1 && plan.states[0] != 0;
    NEXT(write, file, bytes, is_rest ? size / 2 : size);
}

ssize_t pwrite(int file, const void* bytes, size_t size, off_t place)
    FILE_CALL("pwrite", file, pwrite, file, bytes, size, place)
ssize_t pwrite64(int file, const void* bytes, size_t size, off64_t place)
    FILE_CALL("pwrite", file, pwrite64, file, bytes, size, place)
int ftruncate(int file, off_t size) FILE_CALL("ftruncate", file, ftruncate, file, size)
int ftruncate64(int file, off64_t size) FILE_CALL("ftruncate", file, ftruncate64, file, size)
int fsync(int file) FILE_CALL("fsync", file, fsync, file)
int fdatasync(int file) FILE_CALL("fsync", file, fdatasync, file)
int fchmod(int file, mode_t mode) FILE_CALL("fchmod", file, fchmod, file, mode)
int fchown(int file, uid_t user, gid_t group) FILE_CALL("fchown", file, fchown, file, user, group)
int rename(const char* from, const char* to) CALL("rename", AT_FDCWD, to, rename, from, to)
int renameat2(int a, const char* from, int b, const char* to, unsigned flags)
    CALL("rename", b, to, renameat2, a, from, b, to, flags)
int link(const char* from, const char* to) CALL("link", AT_FDCWD, to, link, from, to)
int linkat(int a, const char* from, int b, const char* to, int flags)
    CALL("link", b, to, linkat, a, from, b, to, flags)
int unlink(const char* path) CALL("unlink", AT_FDCWD, path, unlink, path)
int unlinkat(int base, const char* path, int flags) CALL("unlink", base, path, unlinkat, base, path, flags)
int remove(const char* path) CALL("unlink", AT_FDCWD, path, remove, path)
int chmod(const char* path, mode_t mode) CALL("chmod", AT_FDCWD, path, chmod, path, mode)
int mkdir(const char* path, mode_t mode) CALL("mkdir", AT_FDCWD, path, mkdir, path, mode)
int truncate(const char* path, off_t size) CALL("truncate", AT_FDCWD, path, truncate, path, size)

// The system time jumps forward and back. The monotonic clock is not changed.
int clock_gettime(clockid_t clock, struct timespec* now) {
    static long readings;
    const int code = (int)syscall(SYS_clock_gettime, clock, now);
    if (code == 0 && clock == CLOCK_REALTIME && clock_step_s != 0) {
        now->tv_sec += (__atomic_add_fetch(&readings, 1, __ATOMIC_SEQ_CST) % 3 - 1) * clock_step_s;
    }
    return code;
}
