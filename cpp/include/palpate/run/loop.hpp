// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>

#include "palpate/fields/field_table.hpp"
#include "palpate/io/tick_record.hpp"
#include "palpate/realtime/periodic.hpp"
#include "palpate/realtime/timing.hpp"
#include "palpate/run/controller.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// Rate, duration and limits of a control loop.
struct LoopSettings {
    double rate_hz = 1000.0;   ///< ticks a second, 100 to 10 000 [Hz]
    double duration_s = 10.0;  ///< duration of the run [s]; infinity = until a stop is requested
    /// Least share of rate_hz; a lower rate for half a second ends the loop; 0 = no check.
    double lowest_rate_share = 0.8;
    std::uint64_t tolerated = 5;  ///< allowed consecutive ticks that send no force; more end the loop
    /// Longest time between two ticks [s]. A longer time ends the loop, because the certificate does not hold for it.
    double longest_period_s = std::numeric_limits<double>::infinity();
};

inline constexpr double lowest_rate_hz = 100.0;      ///< lowest rate of the control loop [Hz]
inline constexpr double highest_rate_hz = 10'000.0;  ///< highest rate of the control loop [Hz]
/// The rate is reported as too low if the measured rate divided by the chosen rate is below this limit [-]
inline constexpr double held_rate_share = 0.99;

/// Checks the settings of a control loop. Throws std::invalid_argument with the wrong field, its value and the rule.
inline void validate(const LoopSettings& settings) {
    require_field(settings.rate_hz >= lowest_rate_hz && settings.rate_hz <= highest_rate_hz, "rate_hz",
                  settings.rate_hz, readable(lowest_rate_hz) + " to " + readable(highest_rate_hz));
    require_field(settings.duration_s > 0.0, "duration_s", settings.duration_s, "> 0");
    // A certificate without reserve holds for exactly one period, and 1 / rate_hz is rounded
    constexpr double rounding = 1e-9;
    require_field(settings.longest_period_s * settings.rate_hz >= 1.0 - rounding, "longest_period_s",
                  settings.longest_period_s, "at least one period");
    require_field(settings.lowest_rate_share >= 0.0 && settings.lowest_rate_share <= 1.0, "lowest_rate_share",
                  settings.lowest_rate_share, "0 to 1");
}

/// Reason why a control loop ended.
enum class ExitReason : std::uint8_t {
    TimeUp,
    StopRequested,
    Guard,        ///< a guard found a wrong position or force
    DeviceFault,  ///< the device reported a fault, did not respond or lost samples
    RateTooLow,
    NotCertified,  ///< a tick came later, or a force acted later, than the certificate allows
};

/// Returns true if the loop ended because its duration ended or a stop was requested.
[[nodiscard]] constexpr bool is_orderly(ExitReason reason) noexcept {
    return reason == ExitReason::TimeUp || reason == ExitReason::StopRequested;
}

/// Progress of a running control loop, read by other threads. One read may mix numbers of two successive ticks.
struct LoopProgress {
    std::atomic<std::uint64_t> ticks{0};
    std::atomic<std::uint64_t> missed{0};
    std::atomic<std::uint64_t> lost{0};     ///< number of the device's samples that did not arrive
    std::atomic<double> position{0.0};      ///< position of the handle [m or rad]
    std::atomic<double> force{0.0};         ///< force sent to the device [N or N*m]
    std::atomic<double> applied{0.0};       ///< force of the motor [N or N*m]
    std::atomic<double> object_force{0.0};  ///< force of a real object on the handle [N or N*m]
    RateCheck rate;
};

/// Exit reason, counters and energy of a control loop that has ended.
struct LoopReport {
    ExitReason exit_reason = ExitReason::TimeUp;
    Status status = Status::Ok;  ///< status of the last tick
    LoopTiming timing;
    std::array<std::uint64_t, status_texts.size()> ticks_by_status{};
    std::uint64_t lost_samples = 0;
    std::uint64_t repeated_samples = 0;
    double largest_delay =
        std::numeric_limits<double>::quiet_NaN();  ///< largest `Reading::delay`; NaN: unknown [s]
    double longest_delay = std::numeric_limits<double>::infinity();  ///< allowed delay [s]
    ZeroForce zero_force = ZeroForce::Commanded;                     ///< force after the device was closed
    /// Largest value of the energy that the motor gave minus the energy that it received, during the start ramp [J]
    double given_in_ramp = 0.0;
    /// Largest value of the energy that the motor gave minus the energy that it received, after the start ramp [J]
    double given = 0.0;
    double most_stored = 0.0;  ///< upper bound of the energy stored in the object, above its minimum [J]
    /// Number of detected limit cycles; each multiplied all later forces by 0.7
    std::uint64_t limit_cycles = 0;

    /// Returns true if the run ended because its duration ended or a stop was requested, and no device that confirms
    /// zero force left the confirmation out.
    [[nodiscard]] bool orderly() const noexcept {
        return is_orderly(exit_reason) &&
               (zero_force == ZeroForce::Confirmed || zero_force == ZeroForce::Commanded ||
                zero_force == ZeroForce::Held);
    }
    /// Returns the number of ticks, which is the number of records.
    [[nodiscard]] std::uint64_t ticks() const noexcept {
        return std::accumulate(ticks_by_status.begin(), ticks_by_status.end(), std::uint64_t{0});
    }
};

/// Returns the record of a tick for a recording; `first` is the time of the first wake-up [ns].
[[nodiscard]] inline TickRecord record_of(const Tick& tick, const Wake& wake, Nanoseconds first) noexcept {
    TickRecord record;
    record.time = static_cast<double>(wake.now - first) * 1e-9;
    record.position = tick.reading.position;
    record.force = tick.command.force;
    record.applied = tick.reading.applied;
    record.measured = tick.reading.measured;
    record.environment_position = tick.rendered.environment_position;
    record.velocity = tick.reading.velocity;
    record.device_time = tick.reading.device_time;
    record.delay = tick.reading.delay;
    record.lateness = static_cast<double>(wake.now - wake.deadline) * 1e-9;
    record.sequence = tick.reading.sequence;
    record.evaluations = tick.rendered.evaluations;
    record.status = tick.status;
    record.extrapolated = tick.rendered.extrapolated;
    return record;
}

namespace detail {

/// Returns true and sets `reason` if the loop must end: after a final status, or after more than `tolerated`
/// consecutive ticks that sent no force.
[[nodiscard]] inline bool must_stop(Status status, std::uint64_t bad_in_a_row, std::uint64_t tolerated,
                                    ExitReason& reason) noexcept {
    if (!is_final(status) && bad_in_a_row <= tolerated) {
        return false;
    }
    if (status == Status::Stale) {
        reason = ExitReason::NotCertified;
        return true;
    }
    const bool device = status == Status::Fault || status == Status::Timeout || status == Status::Lost;
    reason = device ? ExitReason::DeviceFault : ExitReason::Guard;
    return true;
}

}  // namespace detail

/// Runs the control loop: wake up, run a tick, pass the tick's record to `sink`. The loop runs until the duration ends,
/// a stop is requested, a guard or the device ends the loop, the rate is too low, or a tick is later than the
/// certificate allows. On every exit it sends zero force, or holds the position, closes the device and reports what the device confirmed.
/// `clock` has start() and wait(); `sink`
/// has push(record). Apart from the clock and the device's `exchange`, the loop does not allocate, lock, throw, log or
/// make a system call.
template <class Control, class Clock, class Sink>
void run_loop(Control& controller, const LoopSettings& settings, Clock& clock,
              const std::atomic<bool>& stop_requested, Sink& sink, LoopProgress& progress,
              LoopReport& report) noexcept {
    constexpr double most_ticks = 1e15;  // largest number of ticks of a run, also if its duration is infinite
    const auto deadlines = static_cast<std::uint64_t>(
        std::clamp(std::round(settings.duration_s * settings.rate_hz), 1.0, most_ticks));
    std::uint64_t bad_in_a_row = 0;
    (void)controller.start();  // the status of the first reading is checked in the first tick
    clock.start();
    for (bool running = true; running;) {
        const Wake wake = clock.wait();
        const auto gap = static_cast<double>(wake.now - report.timing.last) * 1e-9;
        const bool too_late = report.timing.wakes() > 0 && gap > settings.longest_period_s;
        report.timing.add(wake);
        const bool window_ended = progress.rate.add(wake.now);
        if (too_late) {
            report.exit_reason = ExitReason::NotCertified;
            break;  // the device held the last force longer than the certificate allows
        }
        if (window_ended && progress.rate.rate_hz() < settings.lowest_rate_share * settings.rate_hz) {
            report.exit_reason = ExitReason::RateTooLow;
            break;  // before a tick, because a process that was suspended would send a force first
        }
        const Tick tick = controller.tick();
        const TickRecord record = record_of(tick, wake, report.timing.first);
        sink.push(record);
        report.status = tick.status;
        ++report.ticks_by_status[static_cast<std::size_t>(tick.status)];
        bad_in_a_row = sends_force(tick.status) ? 0 : bad_in_a_row + 1;

        progress.ticks.store(report.timing.wakes(), std::memory_order_relaxed);
        progress.missed.store(report.timing.missed, std::memory_order_relaxed);
        progress.lost.store(controller.reading_guard().lost(), std::memory_order_relaxed);
        progress.position.store(tick.reading.position, std::memory_order_relaxed);
        progress.force.store(tick.command.force, std::memory_order_relaxed);
        progress.applied.store(tick.reading.applied, std::memory_order_relaxed);
        progress.object_force.store(object_force(record), std::memory_order_relaxed);

        if (detail::must_stop(tick.status, bad_in_a_row, settings.tolerated, report.exit_reason)) {
            running = false;
        } else if (stop_requested.load(std::memory_order_relaxed)) {
            report.exit_reason = ExitReason::StopRequested;
            running = false;
        } else if (report.timing.wakes() + report.timing.missed >= deadlines) {
            report.exit_reason = ExitReason::TimeUp;
            running = false;
        }
    }
    report.zero_force = controller.stop();
    report.lost_samples = controller.reading_guard().lost();
    report.repeated_samples = controller.reading_guard().repeated();
    report.largest_delay = controller.reading_guard().largest_delay();
    report.longest_delay = controller.reading_guard().longest_delay();
    report.given_in_ramp = 0.0 - controller.guards().ramp_observer.least();  // subtraction from 0.0 avoids -0
    report.given = 0.0 - controller.guards().observer.least();
    report.most_stored = controller.guards().account.stored().most();
    report.limit_cycles = controller.guards().limit_cycle.limit_cycles();
}

}  // namespace palpate
