// SPDX-License-Identifier: Apache-2.0
// A device whose readings a test chooses one by one, and the number of instructions of a tick.
#pragma once

#include <signal.h>

#include <cstdint>

#include "palpate/device/device.hpp"

namespace palpate::test {

/// A device that reports one reading again and again, with the next sample number.
class HeldDevice {
  public:
    Opened open() { return {}; }
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        sent = command.force;
        Reading reported = next;
        reported.sequence = ++sequence;
        return reported;
    }
    void close() noexcept {}

    Reading next;
    double sent = 0.0;
    std::uint64_t sequence = 0;
};

#if defined(__x86_64__) && defined(__linux__)

inline volatile std::uint64_t executed = 0;

inline void count_instruction(int /*signal*/) {
    executed = executed + 1;
}

/// Returns the number of machine instructions that a function executes. The trap flag of the processor makes the kernel
/// send SIGTRAP after each one.
template <class Function>
std::uint64_t instructions(const Function& function) {
    struct sigaction action{};
    action.sa_handler = count_instruction;
    struct sigaction before{};
    sigaction(SIGTRAP, &action, &before);
    executed = 0;
    // The area below the stack pointer may be in use
    asm volatile("lea -128(%%rsp), %%rsp; pushfq; orq $0x100, (%%rsp); popfq; lea 128(%%rsp), %%rsp" ::
                     : "memory", "cc");
    function();
    asm volatile("lea -128(%%rsp), %%rsp; pushfq; andq $-257, (%%rsp); popfq; lea 128(%%rsp), %%rsp" ::
                     : "memory", "cc");
    sigaction(SIGTRAP, &before, nullptr);
    return executed;
}

#endif

}  // namespace palpate::test
