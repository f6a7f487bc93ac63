// SPDX-License-Identifier: Apache-2.0
// Runs of the control loop in virtual time, with the promises about its forces and records checked in every tick.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "palpate/guard/guards.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/run/loop.hpp"
#include "palpate/run/session.hpp"

namespace palpate::test {

/// A disturbance of the virtual clock: the wake-up of a tick is late, or the clock jumps by a time and stays there.
struct ClockFault {
    std::uint64_t tick = 0;
    Nanoseconds late = 0;
    Nanoseconds jump = 0;
};

/// Largest values of a run, or of many runs.
struct Extremes {
    double force = 0.0;  ///< largest force / force limit [-]
    double slew = 0.0;   ///< largest increase of the force / slew limit [-]
    double taken = 0.0;  ///< largest energy that the hand took / E0 of the energy account [-]
    std::int32_t evaluations = 0;

    void add(const Extremes& other) {
        force = std::max(force, other.force);
        slew = std::max(slew, other.slew);
        taken = std::max(taken, other.taken);
        evaluations = std::max(evaluations, other.evaluations);
    }
};

/// Checks every exchange, wake-up and record of one run. The checks use the readings and forces at the device, and
/// repeat the computation of a guard only where its promise is a number.
class Invariants {
  public:
    Invariants(const GuardSettings& guards, const LoopSettings& loop, const DeviceProfile& device)
        : settings_{guards}, loop_{loop}, device_{device} {}

    /// First promise that did not hold, with its tick; empty if all held.
    [[nodiscard]] const std::string& broken() const { return broken_; }
    [[nodiscard]] const Extremes& extremes() const { return extremes_; }
    [[nodiscard]] std::uint64_t ticks() const { return records_; }

    /// States that the motor makes other forces than the commands, so that no force limits its energy.
    void motor_does_not_obey() { motor_obeys_ = false; }

    /// Sets the guards of the running controller, whose energy account and limit cycles are compared.
    void watch(const Guards& guards) { guards_ = &guards; }

    void woke(const Wake& wake) noexcept {
        require(!has_ended_, "a tick follows the end of the run");
        // The first wake-up has no previous one
        late_ = wakes_++ > 0 && static_cast<double>(wake.now - woke_) * 1e-9 > loop_.longest_period_s;
        woke_ = wake.now;
    }

    void sends(double force) noexcept {
        require(!is_closed_, "a closed device receives a force");
        require(std::isfinite(force), "the force is not finite");
        require(std::abs(force) <= std::min(settings_.force_limit, device_.force_limit),
                "the force exceeds its limit");
        require(exchanges_ > 0 || force == 0.0, "the first force is not zero");
        ++exchanges_;
        last_sent_ = std::exchange(sent_, force);
    }

    void receives(const Reading& reading) noexcept { reading_ = std::exchange(next_, reading); }

    void closes() noexcept {
        require(!is_closed_, "the device is closed twice");
        require(sent_ == 0.0, "the last force is not zero");
        is_closed_ = true;
    }

    /// Checks the record of a tick, after its force was sent.
    void records(const TickRecord& record) noexcept {
        require(!late_, "a tick later than certified sends a force");
        ++records_;
        require(exchanges_ == records_ + 1, "a record is missing or double");
        require(record.force == sent_, "the record has another force than the device");
        require(same(record.position, reading_.position) && record.sequence == reading_.sequence,
                "the record has another reading than the device");
        require(sends_force(record.status) || sent_ == 0.0, "a tick without force sends a force");
        check_reading(record.status);
        check_limits(record);
        check_account(record.status);
        bad_in_a_row_ = sends_force(record.status) ? 0 : bad_in_a_row_ + 1;
        has_ended_ = is_final(record.status) || bad_in_a_row_ > loop_.tolerated;
        extremes_.evaluations = std::max(extremes_.evaluations, record.evaluations);
        status_ = record.status;
    }

    /// Checks the report after the run.
    void ends(const LoopReport& report) {
        require(is_closed_ && exchanges_ == records_ + 2, "the run does not end with one zero force");
        require(report.ticks() == records_, "the report counts other ticks than the records");
        require(records_ == 0 || report.status == status_,
                "the report has another status than the last record");
        const bool certificate_ended = report.exit_reason == ExitReason::NotCertified;
        const bool before_tick = certificate_ended || report.exit_reason == ExitReason::RateTooLow;
        require(report.timing.wakes() == records_ + (before_tick ? 1 : 0), "a wake-up has no tick");
        require(certificate_ended == late_, "a tick later than certified must end the run");
        const bool by_status =
            report.exit_reason == ExitReason::Guard || report.exit_reason == ExitReason::DeviceFault;
        require(by_status == has_ended_, "the exit reason does not fit to the last ticks");
    }

  private:
    [[nodiscard]] static bool same(double a, double b) noexcept {
        return a == b || (std::isnan(a) && std::isnan(b));
    }

    void require(bool holds, const char* otherwise) noexcept {
        if (!holds && broken_.empty()) {
            std::ostringstream text;
            text.precision(17);
            text << otherwise << " (tick " << records_ << ", force " << sent_ << ", last force " << last_sent_
                 << ", position " << reading_.position << ", sample " << reading_.sequence << ")";
            broken_ = text.str();
        }
    }

    /// A reading that is not new, not a number or too far from the last one makes no force.
    void check_reading(Status status) noexcept {
        // The sample number may wrap around
        const bool is_new = !has_reading_ || static_cast<std::int64_t>(reading_.sequence - sequence_) > 0;
        is_valid_ = sends_force(reading_.status) && is_new && std::isfinite(reading_.position);
        if (!is_valid_) {
            require(!sends_force(status), "an invalid reading makes a force");
            return;
        }
        const auto samples = static_cast<double>(has_reading_ ? reading_.sequence - sequence_ : 1);
        const double step = settings_.largest_speed * device_.period_s * samples;
        if (has_reading_ && std::abs(reading_.position - position_) > step * (1.0 + 1e-9)) {
            require(status == Status::Jump, "a jump of the position is not reported");
        }
        has_reading_ = true;
        sequence_ = reading_.sequence;
        position_ = reading_.position;
    }

    /// Start ramp, limit cycles and slew limit bound the force of this tick.
    void check_limits(const TickRecord& record) noexcept {
        constexpr double rounding = 1.0 + 1e-12;
        const double limit = settings_.force_limit;
        double allowed = limit * cycle_factor_;
        const double ramp_ticks = std::round(settings_.ramp_s * loop_.rate_hz);
        if (static_cast<double>(forces_) < ramp_ticks) {
            allowed *= static_cast<double>(forces_) / ramp_ticks;
        }
        extremes_.force = std::max(extremes_.force, std::abs(sent_) / limit);
        if (settings_.slew_s > 0.0) {
            const double step = limit / (settings_.slew_s * loop_.rate_hz);
            // The energy account may reduce the force faster, towards zero
            const double above = sent_ - std::max(0.0, last_sent_);
            const double below = std::min(0.0, last_sent_) - sent_;
            const double share = std::max(above, below) / step;
            require(share <= rounding, "the force rises faster than the slew limit");
            extremes_.slew = std::max(extremes_.slew, share);
            allowed = std::max(allowed, std::abs(last_sent_) - step);
        }
        require(std::abs(sent_) <= allowed * rounding, "the force exceeds start ramp or limit-cycle factor");
        forces_ += sends_force(record.status) ? 1 : 0;
        for (; limit_cycles_ < guards_->limit_cycle.limit_cycles(); ++limit_cycles_) {
            cycle_factor_ *= 0.7;
        }
    }

    /// The hand takes at most E0. The energy is summed from readings and forces at the device, with the largest one
    /// that the readings allow. It is unknown after a tick without a valid reading.
    void check_account(Status status) noexcept {
        const bool is_interrupted =
            !is_valid_ || status == Status::Timeout || status == Status::Lost || is_final(status);
        is_known_ = is_known_ && !is_interrupted && motor_obeys_ && std::isfinite(reading_.applied);
        if (!settings_.energy_account || !is_known_) {
            return;
        }
        const double step = settings_.certified ? 0.0 : device_.encoder_step;
        const double radius = settings_.certified ? 0.5 * device_.encoder_step : 0.0;
        const double before = proved_;
        proved_ = std::isnan(before)
                      ? reading_.position
                      : std::clamp(before, reading_.position - radius, reading_.position + radius);
        const StoredEnergy& stored = guards_->account.stored();
        if (std::isnan(before)) {
            start_ = stored.most();
        } else {
            const double late = device_.delay_fraction();
            const double mean = late * applied_ + (1.0 - late) * reading_.applied;
            const double share = settings_.certified ? 1.0 : uncertified_credit;
            const double way = std::abs(proved_ - before) + step;
            const double period = 1.0 / loop_.rate_hz + device_.jitter_s;
            put_in_ += mean * (proved_ - before) + 0.5 * step * std::abs(mean - mean_) +
                       share * way * (settings_.device_damping * way / period + settings_.device_friction);
            mean_ = mean;
        }
        applied_ = reading_.applied;
        const double taken = -put_in_ - 0.5 * step * std::abs(mean_);
        require(!(taken > start_ * (1.0 + 1e-9)), "the hand takes more energy than the account allows");
        if (std::isfinite(start_) && start_ > 0.0) {
            extremes_.taken = std::max(extremes_.taken, taken / start_);
        }
    }

    GuardSettings settings_;
    LoopSettings loop_;
    DeviceProfile device_;
    const Guards* guards_ = nullptr;
    bool motor_obeys_ = true;
    std::string broken_;
    Extremes extremes_;

    std::uint64_t exchanges_ = 0;
    std::uint64_t records_ = 0;
    std::uint64_t wakes_ = 0;
    std::uint64_t forces_ = 0;  ///< ticks that sent a force
    std::uint64_t bad_in_a_row_ = 0;
    std::uint64_t limit_cycles_ = 0;  ///< limit cycles detected before this tick
    double cycle_factor_ = 1.0;       ///< factor of all forces after these limit cycles
    Nanoseconds woke_ = 0;
    bool late_ = false;
    bool has_ended_ = false;
    bool is_closed_ = false;
    Status status_ = Status::Ok;
    double sent_ = 0.0;
    double last_sent_ = 0.0;
    Reading next_;     ///< reading of the next tick
    Reading reading_;  ///< reading of this tick
    bool is_valid_ = false;
    bool has_reading_ = false;
    std::uint64_t sequence_ = 0;  ///< number and position of the last valid reading
    double position_ = 0.0;
    double proved_ = std::numeric_limits<double>::quiet_NaN();
    bool is_known_ = true;  ///< true if every tick had a valid reading
    double start_ = 0.0;    ///< E0 of the energy account [J]
    double put_in_ = 0.0;   ///< largest energy that the hand can have put in [J]
    double applied_ = 0.0;  ///< force of the motor at the last reading, and its mean over the period before
    double mean_ = 0.0;
};

/// A device whose exchanges are checked.
template <Device D>
class CheckedDevice {
  public:
    CheckedDevice(D device, Invariants& invariants) : device_{std::move(device)}, invariants_{invariants} {}
    Opened open() { return device_.open(); }
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        invariants_.sends(command.force);
        const Reading reading = device_.exchange(command);
        invariants_.receives(reading);
        return reading;
    }
    void close() noexcept {
        invariants_.closes();
        device_.close();
    }

  private:
    D device_;
    Invariants& invariants_;
};

/// The clock `Periodic` in virtual time, with disturbances in the order of their ticks.
class VirtualClock {
  public:
    VirtualClock(double period_s, std::vector<ClockFault> faults, Invariants& invariants)
        : period_{std::llround(1e9 * period_s)}, faults_{std::move(faults)}, invariants_{invariants} {}
    void start() noexcept { next_ = period_; }
    [[nodiscard]] Wake wait() noexcept {
        Wake wake{next_, next_ + offset_, 0};
        for (; fault_ < faults_.size() && faults_[fault_].tick <= tick_; ++fault_) {
            wake.now += faults_[fault_].late + faults_[fault_].jump;
            offset_ += faults_[fault_].jump;
        }
        ++tick_;
        wake.skipped =
            static_cast<std::uint64_t>(std::max<Nanoseconds>(0, wake.now - wake.deadline) / period_);
        next_ += static_cast<Nanoseconds>(wake.skipped + 1) * period_;
        offset_ = std::min<Nanoseconds>(offset_, 0);  // after a jump forward the deadlines follow the clock
        invariants_.woke(wake);
        return wake;
    }

  private:
    Nanoseconds period_;
    std::vector<ClockFault> faults_;
    Invariants& invariants_;
    std::size_t fault_ = 0;
    std::uint64_t tick_ = 0;
    Nanoseconds next_ = 0;
    Nanoseconds offset_ = 0;  ///< negative after a jump backward
};

/// Runs the control loop on a device in virtual time, with all promises checked. Calls `each(record)` after every tick.
/// The device must be open.
template <Device D, class Each>
LoopReport run_checked(AnyStructure structure, D device, const Guards& guards, const LoopSettings& loop,
                       double period_s, std::vector<ClockFault> clock_faults, Invariants& invariants,
                       Each each) {
    struct Sink {
        Invariants& invariants;
        Each& each;
        void push(const TickRecord& record) noexcept {
            invariants.records(record);
            each(record);
        }
    };
    CheckedDevice<D> checked{std::move(device), invariants};
    Controller controller{checked, std::move(structure), guards};
    invariants.watch(controller.guards());
    VirtualClock clock{period_s, std::move(clock_faults), invariants};
    Sink sink{invariants, each};
    const auto progress = std::make_unique<LoopProgress>();
    const auto report = std::make_unique<LoopReport>();
    const std::atomic<bool> stop_requested{false};
    run_loop(controller, loop, clock, stop_requested, sink, *progress, *report);
    invariants.ends(*report);
    return *report;
}

}  // namespace palpate::test
