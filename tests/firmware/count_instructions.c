/* SPDX-License-Identifier: Apache-2.0 */
/* Plugin of QEMU that counts the executed instructions of each function. At the end it prints "FUNCTION COUNT" lines on
 * standard error. Debian installs no qemu-plugin.h, so the declarations of version 1 stand here. */
#include <inttypes.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

typedef uint64_t plugin_id;
struct translated_block;
struct instruction;

enum { ADD_U64 = 0 };

extern size_t qemu_plugin_tb_n_insns(const struct translated_block* block);
extern struct instruction* qemu_plugin_tb_get_insn(const struct translated_block* block, size_t index);
extern const char* qemu_plugin_insn_symbol(const struct instruction* instruction);
extern void qemu_plugin_register_vcpu_insn_exec_inline(struct instruction* instruction, int operation,
                                                       void* counter, uint64_t value);
extern void qemu_plugin_register_vcpu_tb_trans_cb(plugin_id id,
                                                  void (*called)(plugin_id, struct translated_block*));
extern void qemu_plugin_register_atexit_cb(plugin_id id, void (*called)(plugin_id, void*), void* data);

__attribute__((visibility("default"))) int qemu_plugin_version = 1;

enum { MOST_FUNCTIONS = 512 };
static struct {
    const char* name;
    uint64_t count;
} functions[MOST_FUNCTIONS];

static uint64_t* counter_of(const char* name) {
    size_t k = 0;
    while (k < MOST_FUNCTIONS - 1 && functions[k].name && strcmp(functions[k].name, name) != 0) {
        ++k;
    }
    functions[k].name = name;
    return &functions[k].count;
}

static void translated(plugin_id id, struct translated_block* block) {
    (void)id;
    for (size_t k = 0; k < qemu_plugin_tb_n_insns(block); ++k) {
        struct instruction* instruction = qemu_plugin_tb_get_insn(block, k);
        const char* name = qemu_plugin_insn_symbol(instruction);
        qemu_plugin_register_vcpu_insn_exec_inline(instruction, ADD_U64, counter_of(name ? name : "?"), 1);
    }
}

static void ended(plugin_id id, void* data) {
    (void)id;
    (void)data;
    for (size_t k = 0; k < MOST_FUNCTIONS && functions[k].name; ++k) {
        fprintf(stderr, "%s %" PRIu64 "\n", functions[k].name, functions[k].count);
    }
}

__attribute__((visibility("default"))) int qemu_plugin_install(plugin_id id, const void* info, int count,
                                                               char** words) {
    (void)info;
    (void)count;
    (void)words;
    qemu_plugin_register_vcpu_tb_trans_cb(id, translated);
    qemu_plugin_register_atexit_cb(id, ended, NULL);
    return 0;
}
