// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "palpate/device/device.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// Checks status, delay, sequence number and position of each sample from a device.
///
/// The delay (`Reading::delay`) must not exceed `longest_delay`, because the proofs of a certificate hold for a device
/// that applies each force within this time after its sample. A device that does not measure it is not checked.
///
/// The sequence number must increase by one with each exchange. A larger increase means lost samples; an equal number
/// means a repeated sample. An exchange that ended in a timeout is counted as an exchange, because its sample may
/// arrive late.
///
/// A handle slows down before it stops. If a position moves by `frozen_step` or more in one sample and then repeats
/// exactly for `frozen_samples`, the encoder has failed. A failure while the handle rests cannot be detected.
class ReadingGuard {
  public:
    /// Limits by which a change of position is a jump, and by which a constant position means a frozen encoder.
    struct Limits {
        /// A larger change of position in one tick is a fault (jump) [m or rad]
        double largest_step = std::numeric_limits<double>::infinity();
        /// Change of position in a tick so fast that a stop in the next tick means a frozen encoder [m or rad]
        double frozen_step = 0.0;
        /// Number of consecutive ticks with equal position after fast motion that means a frozen encoder; 0: no check
        std::uint64_t frozen_samples = 0;
        double longest_delay = std::numeric_limits<double>::infinity();  ///< a longer delay is stale [s]
    };

    ReadingGuard() = default;
    explicit ReadingGuard(const Limits& limits) noexcept : limits_{limits} {}

    /// Returns the status of a sample: the status that the device reported, or a fault that the delay, the sequence
    /// number or the position of the sample shows.
    [[nodiscard]] Status check(const Reading& reading) noexcept {
        ++exchanges_;
        largest_delay_ = std::fmax(largest_delay_, reading.delay);
        if (!sends_force(reading.status)) {
            return reading.status;
        }
        // Times of different units are rounded, and a certificate without reserve holds for exactly one delay
        constexpr double rounding = 1e-9;
        if (std::isgreater(reading.delay, limits_.longest_delay * (1.0 + rounding))) {
            return Status::Stale;
        }
        const std::uint64_t advanced = reading.sequence - last_sequence_;
        const std::uint64_t expected = exchanges_;
        // The device sent the last sample again, or an earlier sample
        if (started_ && static_cast<std::int64_t>(advanced) <= 0) {
            ++repeated_;
            return Status::Lost;
        }
        const bool lost = started_ && advanced > expected;
        lost_ += lost ? advanced - expected : 0;
        last_sequence_ = reading.sequence;
        exchanges_ = advanced < expected ? std::min(expected - advanced, most_late_samples) : 0;
        if (!std::isfinite(reading.position)) {
            return Status::NonFinite;
        }
        const Status moved = motion_status(reading.position, static_cast<double>(started_ ? advanced : 1));
        started_ = true;
        if (moved != Status::Ok) {
            return moved;
        }
        return lost ? Status::Lost : reading.status;
    }

    /// Return the number of samples that never arrived from the device, and the number of samples that arrived
    /// repeatedly.
    [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }
    [[nodiscard]] std::uint64_t repeated() const noexcept { return repeated_; }
    /// Returns the largest delay of all samples [s]; NaN if the device does not measure it.
    [[nodiscard]] double largest_delay() const noexcept { return largest_delay_; }
    /// Returns the largest allowed delay [s]; infinite without a limit.
    [[nodiscard]] double longest_delay() const noexcept { return limits_.longest_delay; }

  private:
    /// The guard expects at most this number of samples that arrive after their own tick.
    static constexpr std::uint64_t most_late_samples = 2;

    [[nodiscard]] Status motion_status(double position, double samples) noexcept {
        const double step = std::isnan(last_position_) ? 0.0 : std::abs(position - last_position_);
        last_position_ = position;
        if (step > limits_.largest_step * samples) {
            return Status::Jump;
        }
        if (step > 0.0) {
            was_fast_ = step >= limits_.frozen_step * samples;
            resting_samples_ = 0;
            return Status::Ok;
        }
        ++resting_samples_;
        const bool is_frozen =
            limits_.frozen_samples > 0 && was_fast_ && resting_samples_ >= limits_.frozen_samples;
        return is_frozen ? Status::Frozen : Status::Ok;
    }

    Limits limits_;
    bool started_ = false;
    bool was_fast_ = false;
    std::uint64_t last_sequence_ = 0;
    std::uint64_t exchanges_ = 0;        ///< exchanges whose samples have not arrived
    std::uint64_t resting_samples_ = 0;  ///< consecutive ticks with equal position of the handle
    std::uint64_t lost_ = 0;
    std::uint64_t repeated_ = 0;
    double last_position_ = std::numeric_limits<double>::quiet_NaN();
    double largest_delay_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace palpate
