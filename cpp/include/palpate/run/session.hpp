// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "palpate/guard/guard_settings.hpp"
#include "palpate/guard/guards.hpp"
#include "palpate/io/tick_record.hpp"
#include "palpate/realtime/flight_recorder.hpp"
#include "palpate/realtime/periodic.hpp"
#include "palpate/realtime/privileges.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/run/controller.hpp"
#include "palpate/run/loop.hpp"
#include "palpate/run/record_sinks.hpp"

namespace palpate {

/// A live rendering: the loop in a thread of its own, its recorder in another, and whoever watches in this one.
struct SessionSettings {
    LoopSettings loop;
    RealTimeOptions real_time;
    std::chrono::milliseconds hand_over_every{20};  ///< how old a record may get before it is written
    double ring_s = 10.0;                           ///< how long the writer may be held up
    std::size_t last_ticks = 500;                   ///< kept for the story of a fault
};

/// What is known while it runs, a few times a second.
struct SessionView {
    const LoopProgress& progress;
    const std::vector<std::string>* refused;  ///< privileges; null until the loop has asked for them
    int disk_error;                           ///< errno of the recording, 0 while it is written
};

/// What is left when it is over.
struct SessionReport {
    LoopReport loop;
    std::vector<std::string> refused;    ///< privileges that the loop had to do without
    std::uint64_t lost_records = 0;      ///< that found no room in the ring
    std::vector<TickRecord> last_ticks;  ///< oldest first
};

namespace detail {

/// Where the loop leaves its records: for the recorder, and for the story of a fault.
template <class Recorder>
struct LoopSink {
    Recorder& recorder;
    LastRecords<TickRecord>& last;

    void push(const TickRecord& record) noexcept {
        recorder.push(record);
        last.push(record);
    }
};

}  // namespace detail

/// Renders until the loop ends. The device is open; when this returns it is closed, at zero force, and every
/// record has reached the sinks. `watch(const SessionView&)` is called now and then, and may set `asked`.
template <class Control, class Watch>
[[nodiscard]] SessionReport run_session(Control& controller, const SessionSettings& settings,
                                        RecordSinks& sinks, const std::atomic<bool>& asked, Watch watch) {
    const auto period = static_cast<Nanoseconds>(std::llround(1e9 / settings.loop.rate_hz));
    const auto capacity = static_cast<std::size_t>(settings.ring_s * settings.loop.rate_hz) + 1;
    SessionReport report;
    const auto loop_report = std::make_unique<LoopReport>();  // large: not on the stack
    LoopProgress progress;
    std::atomic<bool> asked_for_privileges{false};
    std::atomic<bool> over{false};
    LastRecords<TickRecord> last{settings.last_ticks};
    const LockedMemory memory;
    const WakefulCores cores;
    using Recorder = FlightRecorder<TickRecord, RecordSinks>;
    Recorder recorder{sinks, capacity, settings.hand_over_every};

    std::thread loop{[&] {
        report.refused = become_real_time(settings.real_time, memory, cores);
        asked_for_privileges.store(true, std::memory_order_release);
        std::conditional_t<Control::paced_by_device, PacedByDevice, Periodic> clock{period};
        detail::LoopSink<Recorder> sink{recorder, last};
        run_loop(controller, settings.loop, clock, asked, sink, progress, *loop_report);
        over.store(true, std::memory_order_release);
    }};
    while (!over.load(std::memory_order_acquire)) {
        std::this_thread::sleep_for(std::chrono::milliseconds{20});
        const bool known = asked_for_privileges.load(std::memory_order_acquire);
        watch(SessionView{progress, known ? &report.refused : nullptr, sinks.file.error()});
    }
    loop.join();
    recorder.stop();
    report.loop = *loop_report;
    report.lost_records = recorder.lost();
    report.last_ticks = last.in_order();
    return report;
}

/// A model rendered live on an open device. Throws std::invalid_argument before anything moves.
template <Device D, class Watch>
[[nodiscard]] SessionReport render_live(const ForceModel& model, const Scheme& scheme, D& device,
                                        const GuardSettings& guards, const SessionSettings& settings,
                                        RecordSinks& sinks, const std::atomic<bool>& asked, Watch watch) {
    validate(settings.loop);
    validate(guards);
    const double period_s = 1.0 / settings.loop.rate_hz;
    validate(scheme, model, period_s);
    return with_structure(model, scheme, period_s, guards.force_limit, [&](auto structure) {
        Controller controller{device, std::move(structure), guards_of(guards, model, scheme, period_s)};
        return run_session(controller, settings, sinks, asked, watch);
    });
}

}  // namespace palpate
