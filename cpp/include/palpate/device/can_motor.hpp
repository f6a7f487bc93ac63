// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/can.h>

#include <cstdint>
#include <string>
#include <utility>

#include "palpate/device/can_bus.hpp"
#include "palpate/device/device.hpp"
#include "palpate/device/device_profile.hpp"
#include "palpate/realtime/periodic.hpp"

namespace palpate {

/// State of a motor, from an answer of its controller.
struct CanAnswer {
    double position = 0.0;  ///< [rad]
    double velocity = 0.0;  ///< [rad/s]
    double torque = 0.0;    ///< > 0 turns to larger positions [N*m]
    int state = 0;          ///< state or fault as the controller numbers it
    bool at_end = false;    ///< true if the position is at an end of its field and therefore not known
};

/// Meaning of a received frame for one motor.
enum class Match : std::uint8_t {
    Other,      ///< of another node
    Malformed,  ///< of this motor, with wrong content
    Answer,     ///< state of this motor
};

/// Counters of the frames of a motor since it was opened.
struct CanHealth {
    std::uint64_t answers = 0;    ///< frames of the motor that answered a command
    std::uint64_t timeouts = 0;   ///< commands without an answer before the deadline
    std::uint64_t late = 0;       ///< answers that arrived after the deadline
    std::uint64_t repeated = 0;   ///< answers without a command
    std::uint64_t malformed = 0;  ///< frames of the motor with a wrong size or content
    std::uint64_t unsent = 0;     ///< commands that could not be sent
};

/// A motor on a CAN bus whose controller holds a line between two commands and answers each command with its state.
///
/// The host sets the rate of the loop. The controller measures the position when a command arrives: Reading::delay is
/// the time from sending a command until the answer to the next one, which is computed from the first one's answer.
/// device_time is the time of the host. No class of this template was tried on hardware.
///
/// Reading::status:
/// - Timeout: the controller did not answer in time.
/// - Lost: the queue of the interface is full.
/// - Fault: the controller reports a fault or is disabled, its position is at an end of its field, the bus is off, or a
///   second controller answers to the same number. Zero torque is sent; the control loop ends after this status.
/// - Limited: the command exceeds the fields of the controller.
///
/// `Protocol` makes and reads the frames. `Bus` sends and receives them; tests replace it.
template <class Protocol, class Bus = CanBus>
class CanMotor {
  public:
    using Settings = typename Protocol::Settings;

    explicit CanMotor(Settings settings = {}, Bus bus = {})
        : settings_{std::move(settings)}, bus_{std::move(bus)} {}

    /// Finds the controller, sets it up and, if `Settings::makes_force` is set, enables it with zero torque.
    Opened open() {
        if (Opened bus = bus_.open(settings_.interface); !bus) {
            return bus;
        }
        std::string reason = start();
        if (!reason.empty()) {
            (void)close();
            return {"drive " + std::to_string(settings_.number) + " on " + settings_.interface + " " +
                    reason};
        }
        return {};
    }

    /// Sends the command and waits for the answer.
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        if (!is_open_) {
            last_.status = Status::Fault;
            last_.applied = 0.0;
            return last_;
        }
        last_.status = exchanged(is_faulty_ ? Command{} : command);
        is_faulty_ = is_faulty_ || last_.status == Status::Fault;
        return last_;
    }

    /// Sends zero torque, then disables the controller, which confirms it with its next answer.
    ZeroForce close() noexcept {
        if (!std::exchange(is_open_, false)) {
            bus_.close();
            return ZeroForce::Confirmed;
        }
        bool is_limited = false;
        (void)bus_.send(Protocol::command_frame(settings_, {}, is_limited));
        const bool sent = bus_.send(Protocol::disable_frame(settings_)) == Sent::Yes;
        ZeroForce zero = sent ? ZeroForce::Sent : ZeroForce::NotSent;
        const Nanoseconds deadline = monotonic_now() + step_wait;
        for (CanAnswer answer; sent && Protocol::confirms_disabled(settings_) && zero == ZeroForce::Sent &&
                               next_answer(answer, deadline);) {
            zero = answer.state == Protocol::disabled_state ? ZeroForce::Confirmed : zero;
        }
        bus_.close();
        return zero;
    }

    [[nodiscard]] const CanHealth& health() const noexcept { return health_; }
    [[nodiscard]] const Settings& settings() const noexcept { return settings_; }
    [[nodiscard]] Bus& bus() noexcept { return bus_; }

    /// Receives the next frame before the deadline that `matches`. For the set-up of a protocol.
    template <class Matches>
    [[nodiscard]] bool find(canfd_frame& frame, Nanoseconds wait, const Matches& matches) noexcept {
        const Nanoseconds deadline = monotonic_now() + wait;
        while (bus_.receive(frame, deadline)) {
            if (matches(frame)) {
                return true;
            }
        }
        return false;
    }

    static constexpr Nanoseconds step_wait = 100'000'000;  ///< longest wait in each step of opening [ns]

  private:
    static constexpr Nanoseconds quiet_wait =
        20'000'000;  ///< wait for a second drive with the same number [ns]
    /// Successive commands with two answers that mean a second drive. CAN may deliver one frame twice (ISO 11898-1: an
    /// error in the last bit of a frame).
    static constexpr int most_repeated = 3;

    /// Reads the next answer of this motor. Returns false without one.
    [[nodiscard]] bool next_answer(CanAnswer& answer, Nanoseconds deadline) noexcept {
        for (canfd_frame frame{}; bus_.receive(frame, deadline);) {
            const Match match = Protocol::read(settings_, frame, answer);
            if (match == Match::Answer) {
                return true;
            }
            health_.malformed += match == Match::Malformed ? 1 : 0;
        }
        return false;
    }

    /// Sends a frame and reads the answer while the motor is opened.
    [[nodiscard]] bool is_answered(const canfd_frame& frame, CanAnswer& answer) noexcept {
        return bus_.send(frame) == Sent::Yes && next_answer(answer, monotonic_now() + step_wait);
    }

    /// Finds and enables the controller. Returns "", or the reason with the cure, behind the name of the drive.
    [[nodiscard]] std::string start() {
        is_open_ = true;
        is_faulty_ = false;
        health_ = {};
        awaited_ = allowed_late_ = repeated_in_a_row_ = 0;
        last_ = {};
        for (canfd_frame old{}; bus_.receive(old, 0);) {
        }
        CanAnswer answer;
        if (!is_answered(Protocol::disable_frame(settings_), answer)) {
            return bus_.is_off()
                       ? "cannot be reached, because the bus is off: check the wires and the bit rate"
                       : "does not answer: check its number, its power, the wires and the bit rate";
        }
        if (next_answer(answer, monotonic_now() + quiet_wait)) {
            return "is two drives that answer to the same number: give one of them another number";
        }
        if (std::string reason = Protocol::set_up(settings_, *this); !reason.empty()) {
            return reason;
        }
        if (!is_answered(settings_.makes_force ? Protocol::enable_frame(settings_)
                                               : Protocol::disable_frame(settings_),
                         answer)) {
            return "does not answer when it is enabled: check its power";
        }
        if (Protocol::has_fault(settings_, answer)) {
            return "reports the fault " + std::to_string(answer.state) +
                   ": look it up in the manual of the drive, remove its cause and clear it";
        }
        if (answer.at_end) {
            return "reports a position at the end of its range: set the zero position of the drive";
        }
        start_ = monotonic_now();
        late_from_ = 0;
        take(answer);
        return "";
    }

    void take(const CanAnswer& answer) noexcept {
        last_.position = answer.position;
        last_.velocity = answer.velocity;
        last_.applied = -answer.torque;
        last_.device_time = static_cast<double>(monotonic_now() - start_) * 1e-9;
        ++last_.sequence;
    }

    /// Reads the answers that arrived since the last exchange. Returns false if a second drive answers.
    [[nodiscard]] bool discard_waiting() noexcept {
        bool repeated = false;
        for (CanAnswer answer; next_answer(answer, 0);) {
            int& expected = allowed_late_ > 0 ? allowed_late_ : awaited_;
            if (expected > 0) {
                --expected;
                ++health_.late;
            } else {
                ++health_.repeated;
                repeated = true;
            }
        }
        repeated_in_a_row_ = repeated ? repeated_in_a_row_ + 1 : 0;
        return repeated_in_a_row_ < most_repeated;
    }

    [[nodiscard]] Status exchanged(const Command& command) noexcept {
        const bool is_alone = discard_waiting();
        bool is_limited = false;
        const canfd_frame frame =
            settings_.makes_force
                ? Protocol::command_frame(settings_, is_alone ? command : Command{}, is_limited)
                : Protocol::disable_frame(settings_);
        const Nanoseconds sent = monotonic_now();
        if (late_from_ == 0) {
            late_from_ =
                sent;  // the state from opening makes no force, however long the loop begins after it
        }
        const Sent result = bus_.send(frame);
        if (result != Sent::Yes) {
            ++health_.unsent;
        } else if (awaited_++ == 0) {
            oldest_unanswered_ = sent;
        }
        CanAnswer answer;
        const bool answered = result == Sent::Yes && next_answer(answer, sent + settings_.wait);
        last_.delay = static_cast<double>(monotonic_now() - late_from_) * 1e-9;
        if (bus_.is_off() || result == Sent::Down) {
            last_.applied = 0.0;
            return Status::Fault;
        }
        if (!answered) {
            health_.timeouts += result == Sent::Yes ? 1 : 0;
            return result == Sent::Yes ? Status::Timeout : Status::Lost;
        }
        ++health_.answers;
        // The answer may be that to the oldest command without one; others may still arrive.
        late_from_ = oldest_unanswered_;
        allowed_late_ += awaited_ - 1;
        awaited_ = 0;
        take(answer);
        if (!is_alone || Protocol::has_fault(settings_, answer) || answer.at_end) {
            return Status::Fault;
        }
        return is_limited ? Status::Limited : Status::Ok;
    }

    Settings settings_;
    Bus bus_;
    CanHealth health_;
    Reading last_;
    bool is_open_ = false;
    bool is_faulty_ = false;     ///< true after a fault: only zero torque is sent
    int awaited_ = 0;            ///< commands since the last answer
    int allowed_late_ = 0;       ///< answers that may still arrive late
    int repeated_in_a_row_ = 0;  ///< successive exchanges with an answer without a command
    Nanoseconds start_ = 0;      ///< time of the first reading [ns]
    /// Earliest time of the state that the applied force does not contain; 0 before the first exchange [ns]
    Nanoseconds late_from_ = 0;
    Nanoseconds oldest_unanswered_ = 0;  ///< time at which the oldest command without an answer was sent [ns]
};

}  // namespace palpate
