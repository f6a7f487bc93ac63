// SPDX-License-Identifier: Apache-2.0
// Plugin of QEMU that counts the instructions of each call of a function whose name begins with "measure_". A call ends
// when an instruction of the function "run" is executed. QEMU prints one line for each function: name, calls, fewest
// and most instructions. The prototypes are those of version 1 of the interface; Debian has no header for them.
#include <stdint.h>
#include <stdio.h>
#include <string.h>

typedef uint64_t plugin_id;
struct plugin_tb;
struct plugin_insn;
typedef void (*tb_callback)(plugin_id, struct plugin_tb *);
typedef void (*insn_callback)(unsigned, void *);
typedef void (*exit_callback)(plugin_id, void *);
void qemu_plugin_register_vcpu_tb_trans_cb(plugin_id, tb_callback);
void qemu_plugin_register_vcpu_insn_exec_cb(struct plugin_insn *, insn_callback, int, void *);
void qemu_plugin_register_atexit_cb(plugin_id, exit_callback, void *);
size_t qemu_plugin_tb_n_insns(const struct plugin_tb *);
struct plugin_insn *qemu_plugin_tb_get_insn(const struct plugin_tb *, size_t);
const char *qemu_plugin_insn_symbol(const struct plugin_insn *);

__attribute__((visibility("default"))) int qemu_plugin_version = 1;

struct measured {
    char name[64];
    uint64_t calls, fewest, most;
};
static struct measured functions[64];
static unsigned used;
static struct measured *active;
static uint64_t executed;

static struct measured *function_of(const char *name) {
    unsigned k = 0;
    while (k < used && strcmp(functions[k].name, name) != 0) {
        ++k;
    }
    if (k == used && used < 64) {
        snprintf(functions[used++].name, sizeof functions[0].name, "%s", name);
    }
    return &functions[k < 64 ? k : 63];
}

static void in_measured(unsigned cpu, void *function) {
    (void)cpu;
    if (active == NULL) {
        active = function;
        executed = 0;
    }
    ++executed;
}

static void in_run(unsigned cpu, void *unused) {
    (void)cpu, (void)unused;
    if (active != NULL) {
        active->fewest = active->calls == 0 || executed < active->fewest ? executed : active->fewest;
        active->most = executed > active->most ? executed : active->most;
        ++active->calls;
        active = NULL;
    }
}

static void elsewhere(unsigned cpu, void *unused) {
    (void)cpu, (void)unused;
    ++executed;
}

static void translated(plugin_id id, struct plugin_tb *block) {
    (void)id;
    for (size_t k = 0; k < qemu_plugin_tb_n_insns(block); ++k) {
        struct plugin_insn *insn = qemu_plugin_tb_get_insn(block, k);
        const char *symbol = qemu_plugin_insn_symbol(insn);
        if (symbol != NULL && strncmp(symbol, "measure_", 8) == 0) {
            qemu_plugin_register_vcpu_insn_exec_cb(insn, in_measured, 0, function_of(symbol));
        } else {
            const int caller = symbol != NULL && strcmp(symbol, "run") == 0;
            qemu_plugin_register_vcpu_insn_exec_cb(insn, caller ? in_run : elsewhere, 0, NULL);
        }
    }
}

static void finished(plugin_id id, void *unused) {
    (void)id, (void)unused;
    for (unsigned k = 0; k < used; ++k) {
        fprintf(stderr, "count %s %llu %llu %llu\n", functions[k].name, (unsigned long long)functions[k].calls,
                (unsigned long long)functions[k].fewest, (unsigned long long)functions[k].most);
    }
}

__attribute__((visibility("default"))) int qemu_plugin_install(plugin_id id, const void *info, int argc, char **argv) {
    (void)info, (void)argc, (void)argv;
    qemu_plugin_register_vcpu_tb_trans_cb(id, translated);
    qemu_plugin_register_atexit_cb(id, finished, NULL);
    return 0;
}
