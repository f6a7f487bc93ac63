// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>

#include "palpate/fields/readable.hpp"
#include "palpate/io/tick_record.hpp"
#include "palpate/realtime/periodic.hpp"
#include "palpate/realtime/timing.hpp"
#include "palpate/run/controller.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// When a rendering ticks, and when it ends.
struct LoopSettings {
    double rate_hz = 1000.0;         ///< 100 to 10 000
    double duration_s = 10.0;        ///< infinity = until it is asked to stop
    double lowest_rate_share = 0.8;  ///< of rate_hz: below it for half a second, the loop stops; 0 = never
    std::uint64_t tolerated = 5;     ///< ticks in a row without a sound sample; one more, and the loop stops
    /// A longer time between two ticks ends the loop: nothing is certified of it [s]
    double longest_period_s = std::numeric_limits<double>::infinity();
};

inline constexpr double lowest_rate_hz = 100.0;
inline constexpr double highest_rate_hz = 10'000.0;
inline constexpr double held_rate_share = 0.99;  ///< of the rate; a loop below it is reported

/// Throws std::invalid_argument: the field, its value, what would be right.
inline void validate(const LoopSettings& settings) {
    const auto require = [](bool holds, const char* field, double value, const char* right) {
        if (!holds) {
            throw std::invalid_argument(std::string(field) + " is " + readable(value) + ", must be " + right);
        }
    };
    require(settings.rate_hz >= lowest_rate_hz && settings.rate_hz <= highest_rate_hz, "rate_hz",
            settings.rate_hz, "100 to 10000");
    require(settings.duration_s > 0.0, "duration_s", settings.duration_s, "> 0");
    require(settings.longest_period_s >= 1.0 / settings.rate_hz, "longest_period_s",
            settings.longest_period_s, "at least one period");
    require(settings.lowest_rate_share >= 0.0 && settings.lowest_rate_share <= 1.0, "lowest_rate_share",
            settings.lowest_rate_share, "0 to 1");
}

/// Why a loop ended.
enum class Ending : std::uint8_t {
    TimeUp,
    Asked,
    Guard,        ///< the samples, or the force made of them, are not to be believed
    DeviceFault,  ///< the device said so, or stopped answering
    RateTooLow,
    NotCertified,  ///< a tick came later than the certificate holds for
};

/// Whether a program that ran such a loop did what it was asked to.
[[nodiscard]] constexpr bool is_orderly(Ending ending) noexcept {
    return ending == Ending::TimeUp || ending == Ending::Asked;
}

/// What a loop lets others see while it runs; each number by itself is true, not all of them of one tick.
struct LoopProgress {
    std::atomic<std::uint64_t> ticks{0};
    std::atomic<std::uint64_t> missed{0};
    std::atomic<std::uint64_t> lost{0};  ///< samples
    std::atomic<double> position{0.0};
    std::atomic<double> force{0.0};
    std::atomic<double> object_force{0.0};  ///< of a real object against the handle
    RateCheck rate;
};

/// What a loop did.
struct LoopReport {
    Ending ending = Ending::TimeUp;
    Status status = Status::Ok;  ///< of the last tick
    LoopTiming timing;
    std::array<std::uint64_t, status_texts.size()> ticks_by_status{};
    std::uint64_t lost_samples = 0;
    std::uint64_t repeated_samples = 0;
    double given_in_ramp =
        0.0;             ///< most energy that the motor had given, net, during the ramp at the start [J]
    double given = 0.0;  ///< the same since its end [J]
    double most_stored = 0.0;  ///< upper bound of the energy that the rendering stored above its least [J]
    std::uint64_t buzzes = 0;  ///< each made the object softer
};

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
    record.lateness = static_cast<double>(wake.now - wake.deadline) * 1e-9;
    record.sequence = tick.reading.sequence;
    record.evaluations = tick.rendered.evaluations;
    record.status = tick.status;
    record.extrapolated = tick.rendered.extrapolated;
    return record;
}

namespace detail {

/// Whether this many bad ticks in a row end the loop, and as what.
[[nodiscard]] inline bool ends(Status status, std::uint64_t bad_in_a_row, std::uint64_t tolerated,
                               Ending& ending) noexcept {
    if (!is_final(status) && bad_in_a_row <= tolerated) {
        return false;
    }
    const bool device = status == Status::Fault || status == Status::Timeout || status == Status::Lost;
    ending = device ? Ending::DeviceFault : Ending::Guard;
    return true;
}

}  // namespace detail

/// The loop: wake, tick, hand over the record, until the time is up, somebody asks, a guard or the device
/// stops it, or it cannot hold its rate. Whatever the reason, the last thing it does is to send zero force and
/// to let the device go. `clock` has start() and wait(); `sink` has push(record). Neither this nor anything
/// that it calls allocates, locks, throws, logs or calls the system, but for the clock and the device.
template <class Control, class Clock, class Sink>
void run_loop(Control& controller, const LoopSettings& settings, Clock& clock, const std::atomic<bool>& asked,
              Sink& sink, LoopProgress& progress, LoopReport& report) noexcept {
    constexpr double centuries = 1e15;  // of ticks: what "without end" means to a counter
    const auto deadlines = static_cast<std::uint64_t>(
        std::clamp(std::round(settings.duration_s * settings.rate_hz), 1.0, centuries));
    std::uint64_t bad_in_a_row = 0;
    (void)controller.start();  // what the first sample says is judged by the first tick
    clock.start();
    for (bool running = true; running;) {
        const Wake wake = clock.wait();
        const auto gap = static_cast<double>(wake.now - report.timing.last) * 1e-9;
        const bool too_late = report.timing.ticks() > 0 && gap > settings.longest_period_s;
        report.timing.add(wake);
        if (too_late) {
            report.ending = Ending::NotCertified;
            break;  // the last force has stood for too long already: what follows is none
        }
        const Tick tick = controller.tick();
        const TickRecord record = record_of(tick, wake, report.timing.first);
        sink.push(record);
        report.status = tick.status;
        ++report.ticks_by_status[static_cast<std::size_t>(tick.status)];
        bad_in_a_row = sends_force(tick.status) ? 0 : bad_in_a_row + 1;

        progress.ticks.store(report.timing.ticks(), std::memory_order_relaxed);
        progress.missed.store(report.timing.missed, std::memory_order_relaxed);
        progress.lost.store(controller.reading_guard().lost(), std::memory_order_relaxed);
        progress.position.store(tick.reading.position, std::memory_order_relaxed);
        progress.force.store(tick.command.force, std::memory_order_relaxed);
        progress.object_force.store(object_force(record), std::memory_order_relaxed);

        const bool window_ended = progress.rate.add(wake.now);
        if (detail::ends(tick.status, bad_in_a_row, settings.tolerated, report.ending)) {
            running = false;
        } else if (window_ended && progress.rate.rate_hz() < settings.lowest_rate_share * settings.rate_hz) {
            report.ending = Ending::RateTooLow;
            running = false;
        } else if (asked.load(std::memory_order_relaxed)) {
            report.ending = Ending::Asked;
            running = false;
        } else if (report.timing.ticks() + report.timing.missed >= deadlines) {
            report.ending = Ending::TimeUp;
            running = false;
        }
    }
    controller.stop();
    report.lost_samples = controller.reading_guard().lost();
    report.repeated_samples = controller.reading_guard().repeated();
    report.given_in_ramp = -controller.guards().at_start.least();
    report.given = -controller.guards().observer.least();
    report.most_stored = controller.guards().tank.stored().most();
    report.buzzes = controller.guards().buzz.buzzes();
}

}  // namespace palpate
