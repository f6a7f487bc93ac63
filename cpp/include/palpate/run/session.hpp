// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "palpate/guard/guards.hpp"
#include "palpate/io/tick_record.hpp"
#include "palpate/realtime/flight_recorder.hpp"
#include "palpate/realtime/periodic.hpp"
#include "palpate/realtime/privileges.hpp"
#include "palpate/run/controller.hpp"
#include "palpate/run/loop.hpp"
#include "palpate/run/record_sinks.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// Settings of a session: one run of the control loop, with a second thread that writes the recording.
struct SessionSettings {
    LoopSettings loop{};
    RealTimeOptions real_time{};
    /// Time between two writes of tick records to the recording file
    std::chrono::milliseconds hand_over_every{20};
    double ring_s = 10.0;          ///< the ring buffer holds the tick records of this time [s]
    std::size_t last_ticks = 500;  ///< number of ticks saved to NAME.fault.csv after a fault
};

/// State of a running session, for messages to the user.
struct SessionView {
    const LoopProgress& progress;
    const std::vector<std::string>*
        refused;     ///< messages on real-time requests that the system refused; null before the requests
    int disk_error;  ///< system error number of a failed write of the recording; 0 without an error
};

/// Result of a session: result of the control loop, and its last ticks.
struct SessionReport {
    LoopReport loop;
    std::vector<std::string> refused;    ///< messages on real-time requests that the system refused
    std::uint64_t lost_records = 0;      ///< records lost because the ring buffer was full
    std::vector<TickRecord> last_ticks;  ///< records of the last ticks, oldest first
};

namespace detail {

/// Passes the record of each tick to the recorder, and to the memory of the last ticks.
template <class Recorder>
struct LoopSink {
    Recorder& recorder;
    LastRecords<TickRecord>& last;

    /// Adds the record of a tick.
    void push(const TickRecord& record) noexcept {
        recorder.push(record);
        last.push(record);
    }
};

}  // namespace detail

/// Function that is called fifty times a second while a session runs; it may request the end of the session.
using Watch = std::function<void(const SessionView&)>;

/// Runs the control loop on an open device until the loop ends. When it returns, the device is closed,
/// `LoopReport::zero_force` states its force, and `sinks` has received the records of all ticks, except lost ones.
template <class Control>
[[nodiscard]] SessionReport run_session(Control& controller, const SessionSettings& settings,
                                        RecordSinks& sinks, const std::atomic<bool>& stop_requested,
                                        const Watch& watch) {
    const auto period = static_cast<Nanoseconds>(std::llround(1e9 / settings.loop.rate_hz));
    const auto capacity = static_cast<std::size_t>(settings.ring_s * settings.loop.rate_hz) + 1;
    SessionReport report;
    // On the heap, because a LoopReport is large
    const auto loop_report = std::make_unique<LoopReport>();
    LoopProgress progress;
    std::atomic<bool> privileges_known{false};
    std::atomic<bool> finished{false};
    LastRecords<TickRecord> last{settings.last_ticks};
    const LockedMemory memory;
    const SleepInhibitor inhibitor;
    using Recorder = FlightRecorder<TickRecord, RecordSinks>;
    Recorder recorder{sinks, capacity, settings.hand_over_every};

    std::thread loop{[&] {
        report.refused = become_real_time(settings.real_time, memory, inhibitor);
        privileges_known.store(true, std::memory_order_release);
        detail::LoopSink<Recorder> sink{recorder, last};
        const auto run = [&](auto clock) {
            run_loop(controller, settings.loop, clock, stop_requested, sink, progress, *loop_report);
        };
        controller.paced_by_device() ? run(PacedByDevice{period}) : run(Periodic{period});
        finished.store(true, std::memory_order_release);
    }};
    while (!finished.load(std::memory_order_acquire)) {
        std::this_thread::sleep_for(std::chrono::milliseconds{20});
        const bool are_known = privileges_known.load(std::memory_order_acquire);
        watch(SessionView{progress, are_known ? &report.refused : nullptr, sinks.file.error()});
    }
    loop.join();
    recorder.stop();
    report.loop = *loop_report;
    report.lost_records = recorder.lost();
    report.last_ticks = last.in_order();
    return report;
}

}  // namespace palpate
