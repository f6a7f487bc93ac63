// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include "palpate/device/device.hpp"
#include "palpate/device/device_profile.hpp"
#include "palpate/device/hid_descriptor.hpp"
#include "palpate/device/hid_node.hpp"
#include "palpate/device/pid_reports.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/realtime/periodic.hpp"

namespace palpate {

/// Address and settings of a force-feedback wheel. A wheel does not report its range, torque and stiffness.
struct WheelSettings {
    std::string node = "/dev/hidraw0";           ///< hidraw node, or the path of a Unix socket
    double half_range = 2.5 * std::numbers::pi;  ///< rotation from the middle to an end of the axis [rad]
    double torque = 1.0;                         ///< torque of a constant force of full magnitude [N*m]
    double stiffness = 0.0;     ///< stiffness of a spring with the full coefficient; 0: no springs [N*m/rad]
    double torque_limit = 1.0;  ///< largest torque that is commanded [N*m]
    double watchdog_s = 0.1;    ///< duration of the effects: time without a start after which they end [s]
    Nanoseconds wait = 1'000'000;  ///< longest wait of a tick for a report of the wheel [ns]
    bool makes_force = true;       ///< false: the wheel is reset and only reports its position
    /// True: a line that one report cannot state ends the run; with two reports a wrong line acts between them
    bool only_springs = false;
};

/// Counters of the reports of a wheel since it was opened.
struct WheelHealth {
    std::uint64_t reports = 0;      ///< reports of the position
    std::uint64_t malformed = 0;    ///< reports of a wrong size, or with a position outside of its range
    std::uint64_t unsent = 0;       ///< force reports that the wheel did not take
    std::uint64_t two_reports = 0;  ///< lines that needed two reports
    double longest_gap_s = 0.0;     ///< longest time between two reports of the position [s]
    double longest_write_s = 0.0;   ///< longest time in which a force report was sent [s]
};

/// Effects of a command in the codes of a wheel.
struct WheelEffects {
    std::int64_t magnitude = 0;    ///< constant force
    std::int64_t coefficient = 0;  ///< stiffness of the spring
    std::int64_t center = 0;       ///< position at which the spring has no force
    bool is_limited = false;       ///< true if the command exceeds the values of the wheel

    /// Returns true if one report states the force.
    [[nodiscard]] bool is_one_report() const noexcept { return coefficient == 0 || magnitude == 0; }
};

/// A force-feedback wheel or joystick of the USB class PID as a device, such as an OpenFFBoard, through hidraw. No wheel
/// was tried on hardware.
///
/// The wheel calculates two effects at its own rate: a constant force, and a spring about a center. A line
/// force + stiffness (x - position) with a stiffness becomes a spring about the position at which the line has no force,
/// position - force / stiffness: one report states it. If this center is outside of the axis, the constant force
/// contains the rest in a second report.
///
/// A wheel sends its position only when it changes, so a tick without a report repeats the last position. The host sets
/// the rate of the loop. Each tick sends one force report, which takes a millisecond at full speed. Both effects have the
/// duration `watchdog_s` and are started again before it ends, so that they end if the program does.
///
/// device_time is the time of the host. `applied` is the torque of the last command at the reported position, because a
/// wheel does not report its torque. Reading::delay is the time from a reading until the force report that contains it
/// was sent; it contains neither the age of the wheel's report nor the calculation in the wheel.
///
/// Reading::status:
/// - Timeout: the newest report is malformed.
/// - Lost: the wheel did not take the force report.
/// - Fault: the node is gone, the position is at an end of the axis and therefore not known, or the wheel reports that
///   it is paused or its motor is disabled. Zero torque is sent; the control loop ends after this status.
/// - Limited: the command exceeds the values of the wheel.
///
/// `Node` sends and receives reports; tests replace it.
template <class Node = hid::Node>
class WheelDevice {
  public:
    explicit WheelDevice(WheelSettings settings = {}, Node node = {})
        : settings_{std::move(settings)}, node_{std::move(node)} {}

    /// Opens the node, resets the wheel and, if `makes_force` is set, creates both effects and starts them with zero
    /// torque.
    Opened open() {
        if (Opened opened = node_.open(settings_.node); !opened) {
            return opened;
        }
        std::string reason;
        try {
            reason = start();
        } catch (const std::runtime_error& error) {
            reason = error.what();
        }
        if (!reason.empty()) {
            (void)close();
            return {"device on " + settings_.node + " " + reason};
        }
        return {};
    }

    /// Sends the command, and waits for a report of the wheel.
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        if (!is_open_) {
            last_.status = Status::Fault;
            last_.applied = 0.0;
            return last_;
        }
        last_.status = exchanged(is_faulty_ ? Command{} : command);
        if (last_.status == Status::Fault && !is_faulty_) {
            is_faulty_ = true;
            (void)send(effects_of({}));
            last_.applied = 0.0;
        }
        return last_;
    }

    /// Sends zero torque, stops and deletes all effects, and disables the motor. Returns `Confirmed` if the wheel then
    /// reports that the motor is disabled.
    ZeroForce close() noexcept {
        if (!std::exchange(is_open_, false)) {
            node_.close();
            return ZeroForce::Confirmed;
        }
        bool sent = true;
        const auto write = [&](const hid::pid::Bytes& report) {
            sent = node_.write(report) == hid::Written::Yes && sent;
        };
        if (has_effects_) {
            sent = send({}) == hid::Written::Yes;
        }
        if (layout_) {
            state_ = {};
            for (const hid::pid::Bytes& report : {stop_, reset_, disable_}) {
                write(report);
            }
        }
        ZeroForce zero = sent ? ZeroForce::Sent : ZeroForce::NotSent;
        if (layout_ && layout_->is_enabled && sent) {
            const Nanoseconds deadline = monotonic_now() + answer_wait;
            while (zero == ZeroForce::Sent && receive(deadline) == hid::Received::Report) {
                zero = state_.enabled == false ? ZeroForce::Confirmed : zero;
            }
        }
        node_.close();
        return zero;
    }

    /// Rounds a command to the values of the wheel. The stiffness is rounded first, then the center, so that the force at
    /// the position of the command is exact to half a step of the center times the stiffness. A number that is not
    /// finite makes zero force.
    [[nodiscard]] WheelEffects effects_of(const Command& command) const noexcept {
        WheelEffects effects;
        if (!(std::isfinite(command.force) && std::isfinite(command.position) &&
              std::isfinite(command.stiffness))) {
            effects.is_limited = true;
            return effects;
        }
        const hid::pid::Layout& layout = *layout_;
        double force = command.force;
        effects.is_limited = command.stiffness < 0.0;
        if (has_springs() && command.stiffness > 0.0) {
            const hid::Value& coefficient = layout.positive_coefficient;
            effects.is_limited = command.stiffness > settings_.stiffness;
            effects.coefficient = coefficient.code_of(command.stiffness / settings_.stiffness) -
                                  std::max<std::int64_t>(coefficient.minimum, 0);
        }
        if (effects.coefficient > 0) {
            const double stiffness = settings_.stiffness * coefficient_share(effects.coefficient);
            const double center = (command.position - force / stiffness) / settings_.half_range;
            effects.center = layout.center.code_of_position(center);
            force =
                std::abs(center) <= 1.0 ? 0.0 : force + stiffness * (center_of(effects) - command.position);
        } else {
            effects.is_limited = effects.is_limited || (command.stiffness > 0.0 && !has_springs());
        }
        effects.is_limited = effects.is_limited || std::abs(force) > settings_.torque_limit;
        const double within = std::clamp(force, -settings_.torque_limit, settings_.torque_limit);
        effects.magnitude = layout.magnitude.code_of(within / settings_.torque);
        return effects;
    }

    /// Returns the force of effects at a position [N*m], > 0 to smaller positions.
    [[nodiscard]] double force_of(const WheelEffects& effects, double position) const noexcept {
        const double constant = settings_.torque * static_cast<double>(effects.magnitude) /
                                static_cast<double>(layout_->magnitude.maximum);
        const double spring = effects.coefficient == 0
                                  ? 0.0
                                  : settings_.stiffness * coefficient_share(effects.coefficient) *
                                        (position - center_of(effects));
        return constant + std::clamp(spring, -settings_.torque_limit, settings_.torque_limit);
    }

    /// Returns the profile that follows from the reports of the wheel. Inertia, damping and friction are not known, and
    /// the delay is assumed to be a period.
    [[nodiscard]] DeviceProfile profile(double rate_hz) const {
        DeviceProfile profile = unmeasured({});
        profile.id = "hid-wheel";
        profile.period_s = profile.delay_s = 1.0 / rate_hz;
        profile.encoder_step = axis_step(layout_->axis);
        profile.force_step = settings_.torque / static_cast<double>(layout_->magnitude.maximum);
        profile.force_limit = settings_.torque_limit;
        return profile;
    }

    /// Returns the steps of stiffness and center of a spring [N*m/rad, rad]; nothing without springs.
    [[nodiscard]] std::optional<std::array<double, 2>> spring_steps() const noexcept {
        if (!has_springs()) {
            return {};
        }
        return std::array{settings_.stiffness * coefficient_share(1), axis_step(layout_->center)};
    }

    [[nodiscard]] const WheelHealth& health() const noexcept { return health_; }
    [[nodiscard]] const WheelSettings& settings() const noexcept { return settings_; }
    [[nodiscard]] Node& node() noexcept { return node_; }

    /// Longest wait for an answer while the wheel is opened or closed [ns].
    static constexpr Nanoseconds answer_wait = 100'000'000;

  private:
    using Usage = hid::pid::Usage;

    /// What the wheel reports about its motor; unset: not reported.
    struct State {
        std::optional<bool> paused, enabled;
    };

    [[nodiscard]] bool has_springs() const noexcept {
        return layout_ && layout_->has_springs() && settings_.stiffness > 0.0;
    }
    [[nodiscard]] double coefficient_share(std::int64_t code) const noexcept {
        const hid::Value& value = layout_->positive_coefficient;
        return static_cast<double>(code) /
               static_cast<double>(value.maximum - std::max<std::int64_t>(value.minimum, 0));
    }
    [[nodiscard]] double center_of(const WheelEffects& effects) const noexcept {
        return settings_.half_range * layout_->center.share_of(effects.center);
    }
    /// Returns the rotation of one step of a position [rad].
    [[nodiscard]] double axis_step(const hid::Value& value) const noexcept {
        return settings_.half_range * value.step();
    }

    /// Reads the layout and sets the wheel up. Returns "", or the reason with the cure, behind the name of the device.
    [[nodiscard]] std::string start() {
        is_open_ = true;
        is_faulty_ = has_effects_ = false;
        health_ = {};
        last_ = {};
        layout_.reset();
        layout_.emplace(hid::read_descriptor(node_.descriptor()));
        input_sizes_ = layout_->input_sizes();
        report_.assign(*std::max_element(input_sizes_.begin(), input_sizes_.end()) + 1, 0);
        stop_ = layout_->device_control(Usage::StopAllEffects);
        reset_ = layout_->device_control(Usage::DeviceReset);
        disable_ = layout_->device_control(Usage::DisableActuators);
        if (settings_.stiffness > 0.0 && !layout_->has_springs()) {
            return "has no spring effect: leave out the stiffness in the name of the device";
        }
        if (layout_->duration_step_s() > settings_.watchdog_s) {
            return "has effects with a duration in steps of " + readable(layout_->duration_step_s()) +
                   " s, but the watchdog is " + readable(settings_.watchdog_s) + " s: plan with a longer one";
        }
        // The wheel may still have effects of another program
        if (node_.write(stop_) != hid::Written::Yes || node_.write(reset_) != hid::Written::Yes) {
            return "does not take a report: plug it in again";
        }
        if (std::string reason = settings_.makes_force ? create_effects() : ""; !reason.empty()) {
            return reason;
        }
        start_ = monotonic_now();
        std::string reason = first_position();
        late_from_ = 0;
        return reason;
    }

    /// Creates both effects and starts them with zero force.
    [[nodiscard]] std::string create_effects() {
        const hid::pid::Layout& layout = *layout_;
        if (node_.write(layout.device_control(Usage::EnableActuators)) != hid::Written::Yes) {
            return "does not enable its motor: check its power and its emergency stop";
        }
        if (const auto gain = layout.full_gain(); gain && node_.write(*gain) != hid::Written::Yes) {
            return "does not take its gain: plug it in again";
        }
        std::int64_t index = 0;
        if (std::string reason = create(Usage::ConstantForce, index); !reason.empty()) {
            return reason;
        }
        constant_ = layout.no_force(index);
        starts_[0] = layout.operate(index, Usage::Start);
        bool sent = node_.write(layout.set_effect(index, Usage::ConstantForce, settings_.watchdog_s)) ==
                    hid::Written::Yes;
        if (has_springs()) {
            const std::int64_t other = index;
            if (std::string reason = create(Usage::Spring, index); !reason.empty()) {
                return reason;
            }
            if (index == other) {
                return "stores two effects in the same block: update its firmware";
            }
            spring_ = layout.no_spring(index, settings_.torque_limit / settings_.torque);
            starts_[1] = layout.operate(index, Usage::Start);
            sent = node_.write(layout.set_effect(index, Usage::Spring, settings_.watchdog_s)) ==
                       hid::Written::Yes &&
                   sent;
        }
        has_effects_ = true;
        sent = sent && send({}) == hid::Written::Yes && node_.write(starts_[0]) == hid::Written::Yes &&
               (!has_springs() || node_.write(starts_[1]) == hid::Written::Yes);
        next_start_ = monotonic_now() + start_every();
        return sent ? "" : "does not take its effects: plug it in again";
    }

    /// Creates an effect and returns "" with the number of its block in `index`, or the reason of a refusal.
    [[nodiscard]] std::string create(Usage type, std::int64_t& index) {
        const hid::pid::Layout& layout = *layout_;
        const std::string name = type == Usage::Spring ? "spring" : "constant force";
        if (!layout.offers(layout.create_type, type) || !layout.offers(layout.effect_type, type)) {
            return "has no effect of the type " + name + ": choose another wheel";
        }
        if (!node_.set_feature(layout.create_effect(type))) {
            return "refuses to create a " + name + ": plug it in again";
        }
        const Nanoseconds deadline = monotonic_now() + answer_wait;
        do {
            hid::pid::Bytes report = layout.load.empty();
            if (!node_.get_feature(report) || report[0] != layout.load.number) {
                return "does not say where it stored a " + name + ": plug it in again";
            }
            if (layout.has_status(report, Usage::LoadFull)) {
                return "has no memory for a " + name +
                       ": end the programs that use the wheel, and plug it in again";
            }
            if (layout.has_status(report, Usage::LoadError)) {
                return "reports an error when it creates a " + name + ": plug it in again";
            }
            if (layout.has_status(report, Usage::LoadSuccess)) {
                index = layout.load_index.read(hid::pid::content(std::span{std::as_const(report)}));
                return layout.load_index.contains(index)
                           ? ""
                           : "stored a " + name + " in block " + std::to_string(index) + ", must be " +
                                 std::to_string(layout.load_index.minimum) + " to " +
                                 std::to_string(layout.load_index.maximum) + ": update its firmware";
            }
        } while (monotonic_now() < deadline);
        return "does not finish creating a " + name + ": plug it in again";
    }

    /// Waits for the first report of the position.
    [[nodiscard]] std::string first_position() {
        const Nanoseconds deadline = monotonic_now() + first_wait;
        for (hid::Received got = hid::Received::Report;
             health_.reports == 0 || got == hid::Received::Report;) {
            got = receive(health_.reports == 0 ? deadline : 0);
            if (got == hid::Received::Gone) {
                return "is gone: plug it in again";
            }
            if (got == hid::Received::None && health_.reports == 0) {
                return health_.malformed > 0
                           ? "sends reports that differ from its descriptor: update its firmware"
                           : "sends no position: turn the wheel a little while it is opened";
            }
        }
        if (is_at_end()) {
            return "reports a position at the end of its axis: turn the wheel to the middle";
        }
        state_ = {};  // a report from before the motor was enabled
        take(monotonic_now());
        last_.velocity = 0.0;
        return "";
    }

    /// Receives a report and takes position or state from it.
    [[nodiscard]] hid::Received receive(Nanoseconds deadline) noexcept {
        std::size_t size = 0;
        const hid::Received got = node_.receive(report_, size, deadline);
        if (got != hid::Received::Report) {
            return got;
        }
        const hid::pid::Layout& layout = *layout_;
        const std::uint8_t number = size == 0 ? 0 : report_[0];
        const auto bytes = hid::pid::content(std::span{std::as_const(report_)}.first(size));
        const bool is_position = number == layout.axis.report;
        const std::int64_t code = layout.axis.read(bytes);
        if (size == 0 || size != input_sizes_[number] || (is_position && !layout.axis.contains(code))) {
            is_malformed_ = true;
            ++health_.malformed;
            return got;
        }
        if (is_position) {
            is_malformed_ = false;
            code_ = code;
            const Nanoseconds now = monotonic_now();
            if (health_.reports++ > 0) {
                health_.longest_gap_s =
                    std::max(health_.longest_gap_s, static_cast<double>(now - last_report_) * 1e-9);
            }
            last_report_ = now;
        }
        const auto flag = [&](const std::optional<hid::Value>& value, std::optional<bool>& to) {
            if (value && number == value->report) {
                to = value->read(bytes) != 0;
            }
        };
        flag(layout.is_paused, state_.paused);
        flag(layout.is_enabled, state_.enabled);
        return got;
    }

    [[nodiscard]] bool is_at_end() const noexcept {
        return code_ <= layout_->axis.minimum || code_ >= layout_->axis.maximum;
    }

    /// Takes the newest position into the reading.
    void take(Nanoseconds now) noexcept {
        const double position = settings_.half_range * layout_->axis.share_of(code_);
        const double time = static_cast<double>(now - start_) * 1e-9;
        last_.velocity =
            time > last_.device_time ? (position - last_.position) / (time - last_.device_time) : 0.0;
        last_.position = position;
        last_.device_time = time;
        last_.applied = has_effects_ ? force_of(sent_, position) : 0.0;
        ++last_.sequence;
    }

    /// Sends the effects: the spring if it has a stiffness or must lose it, the constant force if there is no spring or
    /// its force changes. An effect that ends is sent before one that begins.
    [[nodiscard]] hid::Written send(const WheelEffects& effects) noexcept {
        const hid::pid::Layout& layout = *layout_;
        const auto send_spring = [&] {
            // A coefficient without negative numbers begins at its minimum
            const std::int64_t code =
                effects.coefficient + std::max<std::int64_t>(layout.positive_coefficient.minimum, 0);
            hid::pid::write(spring_, layout.positive_coefficient, code);
            hid::pid::write(spring_, layout.negative_coefficient, code);
            hid::pid::write(spring_, layout.center, effects.center);
            return written(spring_);
        };
        const auto send_constant = [&] {
            hid::pid::write(constant_, layout.magnitude, effects.magnitude);
            return written(constant_);
        };
        const bool spring = has_springs() && (effects.coefficient > 0 || sent_.coefficient > 0);
        const bool constant = effects.coefficient == 0 || effects.magnitude != sent_.magnitude;
        const bool constant_first = effects.magnitude == 0;
        hid::Written result = hid::Written::Yes;
        if (constant && constant_first) {
            result = send_constant();
        }
        if (spring && result == hid::Written::Yes) {
            result = send_spring();
        }
        if (constant && !constant_first && result == hid::Written::Yes) {
            result = send_constant();
        }
        if (result == hid::Written::Yes) {
            sent_ = effects;
        } else {
            ++health_.unsent;
        }
        return result;
    }

    [[nodiscard]] hid::Written written(const hid::pid::Bytes& report) noexcept {
        const Nanoseconds before = monotonic_now();
        const hid::Written result = node_.write(report);
        health_.longest_write_s =
            std::max(health_.longest_write_s, static_cast<double>(monotonic_now() - before) * 1e-9);
        return result;
    }

    /// Each effect is started again twice in its duration.
    [[nodiscard]] Nanoseconds start_every() const noexcept {
        return static_cast<Nanoseconds>(0.25e9 * settings_.watchdog_s);
    }

    [[nodiscard]] Status exchanged(const Command& command) noexcept {
        if (late_from_ == 0) {
            late_from_ = monotonic_now();
        }
        bool is_limited = false;
        hid::Written result = hid::Written::Yes;
        if (settings_.makes_force) {
            const WheelEffects effects = effects_of(command);
            is_limited = effects.is_limited;
            if (!effects.is_one_report()) {
                ++health_.two_reports;
                if (settings_.only_springs) {
                    return Status::Fault;
                }
            }
            result = send(effects);
            if (result == hid::Written::Yes && monotonic_now() >= next_start_) {
                result = written(starts_[has_springs() ? next_effect_ ^= 1U : 0]);
                next_start_ = monotonic_now() + start_every();
            }
        }
        const Nanoseconds sent = monotonic_now();
        last_.delay = static_cast<double>(sent - late_from_) * 1e-9;
        is_malformed_ = false;
        const std::uint64_t before = health_.reports;
        hid::Received got = hid::Received::Report;
        // The reports that wait, or the next one, at most for `wait`
        for (int k = 0; k < HIDRAW_BUFFER_SIZE && got == hid::Received::Report; ++k) {
            const bool has_position = health_.reports != before;
            got = receive(has_position ? 0 : sent + settings_.wait);
        }
        if (got == hid::Received::Gone || result == hid::Written::Gone || is_at_end() ||
            (settings_.makes_force && (state_.paused == true || state_.enabled == false))) {
            return Status::Fault;
        }
        if (is_malformed_) {
            return Status::Timeout;
        }
        take(monotonic_now());
        if (result != hid::Written::Yes) {
            return Status::Lost;
        }
        late_from_ = monotonic_now();
        return is_limited ? Status::Limited : Status::Ok;
    }

    /// Longest wait for the first position [ns]. An OpenFFBoard sends it every 100 ms while the wheel rests.
    static constexpr Nanoseconds first_wait = 2'000'000'000;

    WheelSettings settings_;
    Node node_;
    WheelHealth health_;
    std::optional<hid::pid::Layout> layout_;
    Reading last_;
    std::array<std::size_t, 256> input_sizes_{};  ///< sizes of the input reports by their number [bytes]
    hid::pid::Bytes report_;                      ///< newest report of the wheel
    hid::pid::Bytes constant_, spring_;           ///< force reports
    hid::pid::Bytes stop_, reset_, disable_;      ///< device controls that end the force
    std::array<hid::pid::Bytes, 2> starts_;       ///< reports that start the constant force and the spring
    std::size_t next_effect_ = 0;                 ///< effect that is started next
    Nanoseconds next_start_ = 0;                  ///< time of the next start [ns]
    WheelEffects sent_;                           ///< effects that the wheel has
    State state_;
    std::int64_t code_ = 0;  ///< newest position
    bool is_open_ = false;
    bool is_faulty_ = false;       ///< true after a fault: only zero torque is sent
    bool has_effects_ = false;     ///< true after both effects were created
    bool is_malformed_ = false;    ///< true if the newest report is malformed
    Nanoseconds start_ = 0;        ///< time of the first reading [ns]
    Nanoseconds last_report_ = 0;  ///< time of the newest report of the position [ns]
    /// Time of the reading that the force of the wheel does not contain yet; 0 before the first exchange [ns]
    Nanoseconds late_from_ = 0;
};

static_assert(Device<WheelDevice<>>);

}  // namespace palpate
