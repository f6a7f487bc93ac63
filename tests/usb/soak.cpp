// SPDX-License-Identifier: Apache-2.0
// Runs sessions on the emulated USB device for a given time, at 1 kHz, with a random fault every second:
//
//     tests/usb/run_emulated.py --firmware c -- build/dev/tests/usb/soak [SECONDS [SEED]]
//
// After each session it checks the answer to every fault, the records of all ticks, the torque and the state of the
// device. At the end memory, open files and threads of the process must be those of the first sessions.
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "../cpp/support.hpp"
#include "emulated_machine.hpp"
#include "palpate/device/usb.hpp"
#include "palpate/guard/guards.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/rendering/scale.hpp"
#include "palpate/run/session.hpp"
#include "palpate/run/session_text.hpp"

namespace palpate {
namespace {

/// A fault never ends the session, always ends it, or ends it at some times of the packets.
enum class Ends : std::uint8_t { Never, Always, Perhaps };

/// A fault of the emulated device, and the documented answer of the host.
struct FaultCase {
    const char* name;
    int count;      ///< duration of the fault [packets or frames]
    Status status;  ///< status of a tick after the fault; Ok: no certain status
    Ends ends;
    ExitReason exit;  ///< exit reason, if the fault ends the session
    std::uint64_t StreamHealth::* counted = nullptr;
    std::uint64_t UsbHealth::* counted_by_bus = nullptr;
    double answer_s = 0.4;  ///< longest time from the fault to its answer [s]
};

constexpr ExitReason none = ExitReason::TimeUp;

constexpr std::array<FaultCase, 22> fault_cases{{
    {"short", 1, Status::Ok, Ends::Never, none, &StreamHealth::malformed},
    {"magic", 1, Status::Ok, Ends::Never, none, &StreamHealth::malformed},
    {"version", 1, Status::Ok, Ends::Never, none, &StreamHealth::malformed},
    {"long", 1, Status::Ok, Ends::Never, none, &StreamHealth::malformed},
    {"stall-in", 1, Status::Ok, Ends::Never, none, nullptr, &UsbHealth::stalls},
    {"stall-out", 1, Status::Lost, Ends::Never, none, nullptr, &UsbHealth::stalls},
    {"freeze", 15, Status::Timeout, Ends::Never, none, &StreamHealth::watchdog_trips},
    {"mute", 400, Status::Timeout, Ends::Always, ExitReason::DeviceFault, nullptr, &UsbHealth::timeouts, 0.6},
    {"deaf", 15, Status::Timeout, Ends::Never, none, &StreamHealth::watchdog_trips},
    {"skip", 5, Status::Lost, Ends::Never, none, &StreamHealth::lost},
    {"repeat", 1, Status::Lost, Ends::Never, none, &StreamHealth::repeated},
    {"old-echo", 1, Status::Ok, Ends::Never, none, &StreamHealth::late_echoes},
    {"busy", 1, Status::Ok, Ends::Never, none},
    {"saturate", 20, Status::Limited, Ends::Never, none},
    {"slow", 500, Status::Ok, Ends::Always, ExitReason::RateTooLow, nullptr, nullptr, 1.5},
    {"jump", 5, Status::Jump, Ends::Always, ExitReason::Guard},
    {"frozen-encoder", 150, Status::Frozen, Ends::Perhaps, ExitReason::Guard},
    {"encoder", 1, Status::Fault, Ends::Always, ExitReason::DeviceFault},
    {"over-temperature", 1, Status::Fault, Ends::Always, ExitReason::DeviceFault},
    {"emergency-stop", 1, Status::Fault, Ends::Always, ExitReason::DeviceFault},
    {"reset", 1, Status::Fault, Ends::Always, ExitReason::DeviceFault},
    {"unplug", 1, Status::Fault, Ends::Always, ExitReason::DeviceFault},
}};

/// Returns true if a tick with this status shows a fault. A tick whose force is also scaled reports the scaling first,
/// and an encoder that was frozen during slow motion can jump when it moves again.
bool shows(Status status, Status fault) {
    return status == fault ||
           (fault == Status::Limited &&
            (status == Status::EnergyLimited || status == Status::LimitCycleScaled)) ||
           (fault == Status::Frozen && status == Status::Jump);
}

/// Resources of this process.
struct Resources {
    long resident_kB = 0;
    long threads = 0;
    long files = 0;
};

Resources resources() {
    Resources now;
    std::ifstream status{"/proc/self/status"};
    for (std::string word; status >> word;) {
        if (word == "VmRSS:") {
            status >> now.resident_kB;
        } else if (word == "Threads:") {
            status >> now.threads;
        }
    }
    now.files = static_cast<long>(test::open_files());
    return now;
}

std::ostream& operator<<(std::ostream& out, const Resources& used) {
    return out << used.resident_kB << " kB, " << used.files << " files, " << used.threads << " threads";
}

/// A fault that was given to the emulated device.
struct Injected {
    const FaultCase* fault;
    Nanoseconds time;
};

/// Counters of the whole soak.
struct Totals {
    std::uint64_t sessions = 0;
    std::uint64_t ticks = 0;
    std::array<std::uint64_t, fault_cases.size()> answered{};
    /// Faults whose answer the computer's own lateness hides
    std::uint64_t hidden = 0;
    std::uint64_t ended_by_lateness =
        0;                       ///< sessions that ended because the computer was late, without a fault
    std::uint64_t reopened = 0;  ///< failed attempts to open the device
    std::uint64_t failures = 0;
};

/// Runs sessions and checks them.
class Soak {
  public:
    Soak(double seconds, std::uint64_t seed)
        : seed_{seed},
          random_{seed},
          end_{monotonic_now() + static_cast<Nanoseconds>(1e9 * seconds)},
          record_{std::filesystem::temp_directory_path() /
                  ("palpate-soak-" + std::to_string(::getpid()) + ".csv")} {}
    ~Soak() { std::filesystem::remove(record_); }
    Soak(const Soak&) = delete;
    Soak& operator=(const Soak&) = delete;

    /// Runs sessions until the time ends. Returns true if all checks passed.
    [[nodiscard]] bool run() {
        // The first sessions load libraries and grow the heap to its size.
        constexpr std::uint64_t settling_sessions = 20;
        Resources first;
        std::cout << "seed " << seed_ << "\n";
        while (monotonic_now() < end_) {
            run_session_with_faults();
            if (totals_.sessions == settling_sessions) {
                first = resources();
            }
            if (totals_.sessions % 100 == settling_sessions) {
                std::cout << "after " << totals_.sessions << " sessions: " << resources() << "\n"
                          << std::flush;
            }
        }
        const Resources last = resources();
        std::cout << totals_.sessions << " sessions, " << totals_.ticks << " ticks, "
                  << totals_.ended_by_lateness << " sessions ended by a late computer\n";
        std::uint64_t answered = 0;
        for (std::size_t k = 0; k < fault_cases.size(); ++k) {
            answered += totals_.answered[k];
            std::cout << "  " << fault_cases[k].name << ": " << totals_.answered[k] << " answered\n";
        }
        std::cout << answered << " faults answered, " << totals_.hidden << " hidden by a late computer\n"
                  << "at the end: " << last << "\n";
        if (totals_.sessions > settling_sessions) {
            constexpr long allocator_kB = 2048;  // the heap keeps some free pages
            expect(last.resident_kB <= first.resident_kB + allocator_kB, "memory grew");
            expect(last.files == first.files, "files stay open");
            expect(last.threads == first.threads, "threads continue");
        }
        expect(100 * totals_.reopened <= 100 + totals_.sessions, "the device often does not open");
        constexpr std::uint64_t few = 20;  // so few faults may all fall into a busy second of the computer
        expect(answered + few > totals_.hidden, "the computer is too slow to judge the faults");
        std::cout << (totals_.failures == 0 ? "passed" : "failed") << "\n";
        return totals_.failures == 0;
    }

  private:
    void expect(bool is_true, const std::string& otherwise) {
        if (!is_true) {
            ++totals_.failures;
            std::cout << "FAILED in session " << totals_.sessions << ": " << otherwise << "\n" << std::flush;
        }
    }

    /// Opens the device, renders a spring until a fault ends the session or 20 s have passed, and checks the session.
    void run_session_with_faults() {
        UsbDevice device;
        Opened opened = device.open();
        // A late computer may miss the first packets
        for (int k = 0; k < 5 && !opened; ++k) {
            std::cout << "session " << totals_.sessions << " does not open after " << last_fault_ << ": "
                      << opened.reason << "\n"
                      << std::flush;
            ++totals_.reopened;
            std::this_thread::sleep_for(std::chrono::seconds{1});
            opened = device.open();
        }
        if (!opened) {
            throw std::runtime_error("the device does not open: " + opened.reason);
        }
        constexpr double stiffness = 8.0;
        NetworkParameters network;
        network.linear = {stiffness};
        const ForceModel model{
            network, Domain{{0.0}, {0.5}, Continuation::Linear, Continuation::Linear, std::nullopt}};
        Scheme scheme;
        scheme.structure = StructureKind::Direct;
        const DeviceProfile profile = device.profile();
        const GuardSettings guards = guards_for(scale_of(model, true), profile);
        SessionSettings settings;
        settings.loop.duration_s =
            std::min(20.0, std::max(1.0, 1e-9 * static_cast<double>(end_ - monotonic_now())));
        settings.real_time.priority = 0;
        // A computer with other load misses deadlines, which must not end every session.
        settings.loop.tolerated = 50;
        settings.loop.lowest_rate_share = 0.5;
        RecordSinks sinks;
        sinks.keeps = true;
        sinks.kept = std::move(kept_);
        if (const std::string reason = sinks.file.open(record_, {}, {}, true); !reason.empty()) {
            throw std::runtime_error(reason);
        }
        std::vector<Injected> injected;
        Nanoseconds next = monotonic_now() + nanoseconds_a_second / 2;
        const Nanoseconds last = monotonic_now() + static_cast<Nanoseconds>(1e9 * settings.loop.duration_s);
        const auto inject = [&](const SessionView& /*view*/) {
            if (monotonic_now() < next) {
                return;
            }
            const FaultCase& fault = fault_cases[random_() % fault_cases.size()];
            if (monotonic_now() + static_cast<Nanoseconds>(1e9 * fault.answer_s) > last) {
                next = last;  // the session ends before the answer to another fault
                return;
            }
            injected.push_back({&fault, monotonic_now()});
            test::send_order(std::string("fault ") + fault.name + " " + std::to_string(fault.count));
            next += static_cast<Nanoseconds>(1e9 * std::max(1.0, fault.answer_s + 0.5));
        };
        const std::atomic<bool> stop_requested{false};
        Controller controller{device, make_structure(model, scheme, profile.period_s, guards.force_limit),
                              guards_of(guards, model, scheme, profile.period_s)};
        const SessionReport report = run_session(controller, settings, sinks, stop_requested, inject);
        ++totals_.sessions;
        totals_.ticks += report.loop.ticks();
        check_records(report, sinks, guards);
        check_faults(report, sinks.kept, injected, device.health(), guards);
        restore(device, injected);
        kept_ = std::move(sinks.kept);
        kept_.clear();
    }

    /// Checks that every tick has one record, in order, in memory and in the file, with a force within its limits.
    void check_records(const SessionReport& report, RecordSinks& sinks, const GuardSettings& guards) {
        const std::uint64_t ticks = report.loop.ticks();
        expect(report.lost_records == 0, "records are lost");
        expect(sinks.kept.size() == ticks, "records in memory are missing or double");
        expect(sinks.file.written() == ticks, "records in the file are missing or double");
        expect(sinks.file.finish(exit_text(report.loop, {}), "").empty(), "the recording cannot be finished");
        std::ifstream file{record_};
        std::uint64_t rows = 0;
        for (std::string line; std::getline(file, line);) {
            rows += !line.empty() && std::isdigit(static_cast<unsigned char>(line[0])) != 0 ? 1 : 0;
        }
        expect(rows == ticks,
               "the file has " + std::to_string(rows) + " rows of " + std::to_string(ticks) + " ticks");
        double last_time = -1.0;
        std::uint64_t last_sequence = 0;
        bool in_order = true;
        bool within_limits = true;
        for (const TickRecord& tick : sinks.kept) {
            in_order = in_order && tick.time > last_time &&
                       (!sends_force(tick.status) || tick.sequence > last_sequence);
            within_limits = within_limits && std::abs(tick.force) <= guards.force_limit &&
                            (sends_force(tick.status) || tick.force == 0.0);
            last_time = tick.time;
            last_sequence = sends_force(tick.status) ? tick.sequence : last_sequence;
        }
        expect(in_order, "records are not in order");
        expect(within_limits, "a force is not finite, above its limit, or not zero in a tick without force");
    }

    /// Checks the answer to every fault of a session, and the reason of its end.
    void check_faults(const SessionReport& report, const std::vector<TickRecord>& ticks,
                      const std::vector<Injected>& injected, const UsbHealth& health,
                      const GuardSettings& guards) {
        const auto time_of = [&](const TickRecord& tick) {
            return report.loop.timing.first + static_cast<Nanoseconds>(std::llround(1e9 * tick.time));
        };
        bool explained = is_orderly(report.loop.exit_reason);
        bool computer_was_late = false;
        for (const Injected& one : injected) {
            const FaultCase& fault = *one.fault;
            const Nanoseconds until = one.time + static_cast<Nanoseconds>(1e9 * fault.answer_s);
            const bool ended = time_of(ticks.back()) < until;
            bool has_status = fault.status == Status::Ok;
            bool late = false;
            double slowest = std::numeric_limits<double>::infinity();  // speed at the start of the fault
            Nanoseconds before = one.time;
            for (const TickRecord& tick : ticks) {
                const Nanoseconds time = time_of(tick);
                if (time >= one.time && time < until) {
                    has_status = has_status || shows(tick.status, fault.status);
                    late = late || time - before > 4 * nanoseconds_a_second / 1000;
                    before = time;
                }
                if (std::abs(time - one.time) < nanoseconds_a_second / 100) {
                    slowest = std::min(slowest, std::abs(tick.velocity));
                }
            }
            const bool detectable = fault.status != Status::Frozen || slowest > 1.5 * guards.frozen_speed;
            const bool ends_rightly = report.loop.exit_reason == fault.exit && fault.ends != Ends::Never &&
                                      (fault.status == Status::Ok || shows(report.loop.status, fault.status));
            // Faults of this counter so far, this one included
            const auto of_counter = static_cast<std::uint64_t>(
                std::count_if(injected.data(), &one + 1, [&](const Injected& earlier) {
                    return earlier.fault->counted == fault.counted &&
                           earlier.fault->counted_by_bus == fault.counted_by_bus;
                }));
            const bool counted =
                (fault.counted == nullptr || health.stream.*fault.counted >= of_counter) &&
                (fault.counted_by_bus == nullptr || health.*fault.counted_by_bus >= of_counter);
            const bool right = has_status && counted && (ended ? ends_rightly : fault.ends != Ends::Always);
            explained = explained || (ended && ends_rightly);
            computer_was_late = computer_was_late || late;
            if (right || (!detectable && !ended)) {
                ++totals_.answered[static_cast<std::size_t>(one.fault - fault_cases.data())];
            } else if (late || (ended && !explained)) {
                ++totals_.hidden;
            } else {
                expect(false, std::string(fault.name) + ": status " + (has_status ? "" : "not ") + "found, " +
                                  (counted ? "" : "not ") + "counted, session " +
                                  (ended ? "ended: " : "continued, ") + exit_text(report.loop, {}));
            }
        }
        if (!explained) {
            ++totals_.ended_by_lateness;
            const Status status = report.loop.status;
            const bool possible = report.loop.exit_reason == ExitReason::RateTooLow ||
                                  status == Status::Timeout || status == Status::Lost;
            expect(possible, "no fault explains the end: " + exit_text(report.loop, {}));
        }
    }

    /// Checks that the device is at rest, then removes the fault that ended the session.
    void restore(UsbDevice& device, const std::vector<Injected>& injected) {
        expect(device.in_flight() == 0, "transfers are in flight after closing");
        const std::string last = injected.empty() ? "no fault" : injected.back().fault->name;
        last_fault_ = last;
        if (last == "unplug") {
            std::this_thread::sleep_for(
                std::chrono::milliseconds{20});  // the fault may follow the end of the session
            test::send_order("plug");
        }
        // The frames that remain of the last fault
        std::this_thread::sleep_for(std::chrono::milliseconds{last == "slow"   ? 1700
                                                              : last == "mute" ? 1000
                                                                               : 160});
        expect(test::state("torque_uNm") == 0.0, "the motor has a torque after the session");
        expect(test::state("enabled") == 0.0, "the device is enabled after the session");
        detail::UsbConnection connection;
        const Opened opened = connection.open("");
        expect(static_cast<bool>(opened) && connection.request(wire::Request::Clear, 0) == 0,
               "the fault cannot be cleared: " + opened.reason);
    }

    std::uint64_t seed_;
    std::mt19937_64 random_;
    Nanoseconds end_;
    std::string record_;
    std::string last_fault_ = "no fault";  ///< last fault of the last session
    std::vector<TickRecord> kept_;         ///< memory for the records of a session
    Totals totals_;
};

}  // namespace
}  // namespace palpate

int main(int count, char** words) {
    if (std::getenv("PALPATE_EMULATOR") == nullptr) {
        std::cerr << "Usage: tests/usb/run_emulated.py -- soak [SECONDS [SEED]]\n";
        return 2;
    }
    // All threads share one heap, so that only a leak increases its size.
    ::mallopt(M_ARENA_MAX, 1);
    try {
        const double seconds = count > 1 ? std::stod(words[1]) : palpate::test::cases(6);
        const std::uint64_t seed = count > 2 ? std::stoull(words[2]) : 1;
        return palpate::Soak{seconds, seed}.run() ? 0 : 1;
    } catch (const std::exception& error) {
        std::cerr << "soak: " << error.what() << "\n";
        return 1;
    }
}
