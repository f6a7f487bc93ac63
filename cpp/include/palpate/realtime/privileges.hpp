// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <string>
#include <system_error>
#include <vector>

namespace palpate {

/// Settings that the control loop's thread requests from the operating system to run without delays. If the system
/// refuses a request, ticks can be late; the refusal is reported, and the loop runs.
struct RealTimeOptions {
    int priority = 80;  ///< real-time priority (SCHED_FIFO), 1 to 99; 0 = ordinary thread
    int cpu = -1;       ///< core of the control loop; -1 = highest core number allowed, -2 = any
};

/// Keeps the memory of the process from being swapped out during the lifetime of this object. Memory that the process
/// has reserved without using it stays unused: libraries of Python reserve more than a gigabyte.
class LockedMemory {
  public:
    LockedMemory() noexcept : error_{mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0 ? 0 : errno} {}
    ~LockedMemory() {
        if (error_ == 0) {
            munlockall();
        }
    }
    LockedMemory(const LockedMemory&) = delete;
    LockedMemory& operator=(const LockedMemory&) = delete;

    /// Returns 0, or the system error number if the memory could not be locked.
    [[nodiscard]] int error() const noexcept { return error_; }

  private:
    int error_;
};

/// Prevents the processor cores from entering a sleep state during the lifetime of this object. Waking up from a deep
/// sleep state takes longer than the computation of a tick; on a virtual machine the host's scheduler controls also a
/// light sleep state. The Linux kernel keeps the wake-up latency that is written to /dev/cpu_dma_latency while that
/// file is open (Documentation/power/pm_qos_interface.rst).
class SleepInhibitor {
  public:
    SleepInhibitor() noexcept : file_{open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC)} {
        constexpr std::int32_t latency_us = 0;
        const bool is_set = file_ >= 0 && write(file_, &latency_us, sizeof latency_us) == sizeof latency_us;
        error_ = is_set ? 0 : errno;
    }
    ~SleepInhibitor() {
        if (file_ >= 0) {
            close(file_);
        }
    }
    SleepInhibitor(const SleepInhibitor&) = delete;
    SleepInhibitor& operator=(const SleepInhibitor&) = delete;

    /// Returns 0, or the system error number if processor cores could not be kept out of sleep states.
    [[nodiscard]] int error() const noexcept { return error_; }

  private:
    int file_;
    int error_;
};

namespace detail {

/// Returns the highest core number among the processor cores that this thread may use.
[[nodiscard]] inline int last_allowed_cpu() noexcept {
    cpu_set_t allowed;
    CPU_ZERO(&allowed);
    sched_getaffinity(0, sizeof allowed, &allowed);
    int last = 0;
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
        last = CPU_ISSET(cpu, &allowed) ? cpu : last;
    }
    return last;
}

/// Writes to 64 KiB of stack memory, so that its pages are in memory before the loop uses them.
inline void prefault_stack() noexcept {
    constexpr std::size_t bytes = 65'536;
    std::array<volatile char, bytes> page{};
    for (std::size_t k = 0; k < page.size(); k += 1024) {
        page[k] = 1;
    }
}

}  // namespace detail

/// Makes the calling thread a real-time thread: it receives only signals of faults of the thread, such as SIGSEGV, has
/// the core and the priority in `options`, and has 64 KiB of its stack in memory. Returns one sentence for each request
/// that the operating system refused, those of `memory` and `inhibitor` included.
[[nodiscard]] inline std::vector<std::string> become_real_time(const RealTimeOptions& options,
                                                               const LockedMemory& memory,
                                                               const SleepInhibitor& inhibitor) {
    std::vector<std::string> refused;
    sigset_t others;
    sigfillset(&others);
    for (const int own : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGSYS}) {
        sigdelset(&others, own);
    }
    pthread_sigmask(SIG_SETMASK, &others, nullptr);
    if (memory.error() != 0) {
        refused.push_back(std::string("memory is not locked (") +
                          std::generic_category().message(memory.error()) +
                          "): swapping can delay a tick; raise the limit with ulimit -l");
    }
    if (inhibitor.error() != 0) {
        refused.push_back(std::string("the cores may sleep deeply between ticks (") +
                          std::generic_category().message(inhibitor.error()) +
                          "): waking up can delay a tick; allow writing to /dev/cpu_dma_latency");
    }
    if (options.cpu != -2) {
        const int cpu = options.cpu == -1 ? detail::last_allowed_cpu() : options.cpu;
        cpu_set_t one;
        CPU_ZERO(&one);
        CPU_SET(static_cast<unsigned>(cpu), &one);
        if (const int error = pthread_setaffinity_np(pthread_self(), sizeof one, &one); error != 0) {
            refused.push_back("the loop is not kept on core " + std::to_string(cpu) + " (" +
                              std::generic_category().message(error) + ")");
        }
    }
    if (options.priority > 0) {
        const sched_param priority{options.priority};
        if (const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority); error != 0) {
            refused.push_back(std::string("no real-time priority (") +
                              std::generic_category().message(error) +
                              "): other programs can delay a tick; allow it with an rtprio line in "
                              "/etc/security/limits.conf");
        }
    }
    detail::prefault_stack();
    return refused;
}

}  // namespace palpate
