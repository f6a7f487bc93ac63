// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/can.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "palpate/device/can_bus.hpp"
#include "palpate/device/device.hpp"
#include "palpate/device/device_profile.hpp"
#include "palpate/device/mit_wire.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/realtime/periodic.hpp"

namespace palpate {

/// Address and settings of an MIT-mode drive.
struct MitSettings {
    std::string interface = "can0";  ///< CAN interface, or the path of a Unix socket
    std::uint8_t number = 1;         ///< CAN number of the drive, 1 to 127; of a Damiao drive 1 to 15
    mit::Preset preset = mit::presets.front();
    Nanoseconds wait = 2'000'000;  ///< longest wait of a tick for the answer of the drive [ns]
    /// Time without a frame after which a Damiao drive ends its torque [s]; other makers: set it with their tool
    double watchdog_s = 0.02;
    bool makes_force = true;  ///< false: the drive is never enabled and only reports its position
};

/// Counters of the frames of a drive since it was opened.
struct MitHealth {
    std::uint64_t answers = 0;    ///< frames of the drive that answered a command
    std::uint64_t timeouts = 0;   ///< commands without an answer before the deadline
    std::uint64_t late = 0;       ///< answers that arrived after the deadline
    std::uint64_t repeated = 0;   ///< answers without a command
    std::uint64_t malformed = 0;  ///< frames with the number of the drive and a wrong size
    std::uint64_t unsent = 0;     ///< commands that could not be sent
};

/// A motor whose drive holds a line, torque = kp (p_0 - p) + kd (v_0 - v) + t_0, in the MIT mode of Damiao, CubeMars
/// and RobStride drives over CAN. kd is 0. This class was never tried on hardware.
///
/// The drive answers each command with position, velocity and torque, so the host sets the rate of the loop. It
/// measures the position when a command arrives: Reading::delay is the time from sending a command until the answer to
/// the next one, which is computed from the first one's answer. device_time is the time of the host.
///
/// Reading::status:
/// - Timeout: the drive did not answer in time.
/// - Lost: the queue of the interface is full.
/// - Fault: the drive reports a fault or is disabled, its position is at an end of its field, the bus is off, or a second
///   drive answers to the same number. Zero torque is sent; the control loop ends after this status.
/// - Limited: the command exceeds the fields of the drive.
///
/// `Bus` sends and receives frames; tests replace it.
template <class Bus = CanBus>
class MitDevice {
  public:
    explicit MitDevice(MitSettings settings = {}, Bus bus = {})
        : settings_{std::move(settings)}, bus_{std::move(bus)} {}

    /// Finds the drive, compares its ranges with the preset if it reports them, sets its watchdog and, with
    /// `makes_force`, enables it with zero torque.
    Opened open() {
        const Opened bus = bus_.open(settings_.interface);
        if (!bus) {
            return bus;
        }
        std::string reason = start();
        if (!reason.empty()) {
            (void)close();
            return {"drive " + std::to_string(settings_.number) + " on " + settings_.interface + " " + reason};
        }
        return {};
    }

    /// Sends the command and waits for the answer of the drive.
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

    /// Sends zero torque, then disables the drive. The drive confirms it with an answer that says so.
    ZeroForce close() noexcept {
        if (!std::exchange(is_open_, false)) {
            bus_.close();
            return ZeroForce::Confirmed;
        }
        (void)send(mit::frame_of({}, settings_.preset.ranges));
        const bool sent = send(mit::disable_frame) == Sent::Yes;
        ZeroForce zero = sent ? ZeroForce::Sent : ZeroForce::NotSent;
        const Nanoseconds deadline = monotonic_now() + step_wait;
        const bool confirms = settings_.preset.maker == mit::Maker::Damiao;
        for (mit::Answer answer; sent && confirms && zero == ZeroForce::Sent && next_answer(answer, deadline);) {
            zero = answer.state == 0 ? ZeroForce::Confirmed : zero;
        }
        bus_.close();
        return zero;
    }

    [[nodiscard]] const MitHealth& health() const noexcept { return health_; }
    [[nodiscard]] const MitSettings& settings() const noexcept { return settings_; }
    [[nodiscard]] Bus& bus() noexcept { return bus_; }

    /// Returns the profile that follows from the fields of the drive. Damping and friction are 0, because the drive does
    /// not report them.
    [[nodiscard]] DeviceProfile profile(double rate_hz) const {
        const mit::Ranges& ranges = settings_.preset.ranges;
        DeviceProfile profile = unmeasured({});
        profile.id = std::string(settings_.preset.name);
        profile.period_s = profile.delay_s = 1.0 / rate_hz;
        profile.encoder_step = mit::step_of(-ranges.position, ranges.position, mit::position_bits);
        profile.force_step = mit::step_of(-ranges.torque, ranges.torque, mit::field_bits);
        profile.force_limit = ranges.torque;
        return profile;
    }

  private:
    static constexpr Nanoseconds step_wait = 100'000'000;  ///< longest wait in each step of opening [ns]
    static constexpr Nanoseconds quiet_wait = 20'000'000;  ///< wait for a second drive with the same number [ns]
    /// Successive commands with two answers that mean a second drive. CAN may deliver one frame twice (ISO 11898-1: an
    /// error in the last bit of a frame).
    static constexpr int most_repeated = 3;
    static constexpr canid_t register_number = 0x7FF;
    static constexpr std::uint8_t read_register = 0x33;
    static constexpr std::uint8_t write_register = 0x55;
    static constexpr std::uint8_t enabled_state = 1;  ///< state of an enabled Damiao drive

    [[nodiscard]] Sent send(const mit::Frame& bytes, std::optional<canid_t> number = {}) noexcept {
        can_frame frame{};
        frame.can_id = number.value_or(settings_.number);
        frame.len = static_cast<std::uint8_t>(bytes.size());
        std::copy(bytes.begin(), bytes.end(), static_cast<std::uint8_t*>(frame.data));
        return bus_.send(frame);
    }

    /// Receives the next frame of this drive with 8 bytes.
    [[nodiscard]] bool next_frame(mit::Frame& bytes, Nanoseconds deadline) noexcept {
        can_frame frame{};
        const std::uint8_t mask = settings_.preset.maker == mit::Maker::Damiao ? 0xF : 0xFF;
        while (bus_.receive(frame, deadline)) {
            // The frames of other programs to the drive have its number as CAN number
            const bool is_answer = (frame.can_id & ~canid_t{CAN_SFF_MASK}) == 0 &&
                                   frame.can_id != settings_.number && frame.can_id != register_number;
            if (!is_answer || frame.len == 0 || (frame.data[0] & mask) != (settings_.number & mask)) {
                continue;
            }
            if (frame.len != bytes.size()) {
                ++health_.malformed;
                continue;
            }
            std::copy_n(static_cast<const std::uint8_t*>(frame.data), bytes.size(), bytes.begin());
            return true;
        }
        return false;
    }

    /// Reads the next answer of this drive. Returns false without one.
    [[nodiscard]] bool next_answer(mit::Answer& answer, Nanoseconds deadline) noexcept {
        mit::Frame bytes{};
        if (!next_frame(bytes, deadline)) {
            return false;
        }
        answer = mit::answer_of(bytes, settings_.preset.maker, settings_.preset.ranges);
        return true;
    }

    /// Returns the answer to a register frame; nothing without an answer.
    [[nodiscard]] std::optional<std::uint32_t> register_answer(std::uint8_t command, std::uint8_t address,
                                                               std::uint32_t value) {
        const auto byte = [value](int index) { return static_cast<std::uint8_t>(value >> (8 * index)); };
        (void)send({settings_.number, 0, command, address, byte(0), byte(1), byte(2), byte(3)},
                   register_number);
        const Nanoseconds deadline = monotonic_now() + step_wait;
        for (mit::Frame bytes{}; next_frame(bytes, deadline);) {
            if (bytes[1] == 0 && bytes[2] == command && bytes[3] == address) {
                return static_cast<std::uint32_t>(bytes[4]) | static_cast<std::uint32_t>(bytes[5]) << 8U |
                       static_cast<std::uint32_t>(bytes[6]) << 16U |
                       static_cast<std::uint32_t>(bytes[7]) << 24U;
            }
        }
        return {};
    }

    /// Finds and enables the drive. Returns "", or the reason with the cure, behind the name of the drive.
    [[nodiscard]] std::string start() {
        is_open_ = true;
        is_faulty_ = false;
        health_ = {};
        awaited_ = allowed_late_ = repeated_in_a_row_ = 0;
        last_ = {};
        for (can_frame old{}; bus_.receive(old, 0);) {
        }
        mit::Answer answer;
        if (send(mit::disable_frame) != Sent::Yes || !next_answer(answer, monotonic_now() + step_wait)) {
            return bus_.is_off() ? "cannot be reached, because the bus is off: check the wires and the bit rate"
                                 : "does not answer: check its number, its power, the wires and the bit rate";
        }
        if (next_answer(answer, monotonic_now() + quiet_wait)) {
            return "is two drives that answer to the same number: give one of them another number";
        }
        if (settings_.preset.maker == mit::Maker::Damiao) {
            if (std::string reason = set_up_damiao(); !reason.empty()) {
                return reason;
            }
        }
        if (send(settings_.makes_force ? mit::enable_frame : mit::disable_frame) != Sent::Yes ||
            !next_answer(answer, monotonic_now() + step_wait)) {
            return "does not answer when it is enabled: check its power";
        }
        if (has_fault(answer)) {
            return "reports the fault " + std::to_string(answer.state) +
                   ": look it up in the manual of the drive, remove its cause and clear it";
        }
        if (answer.at_end) {
            return "reports a position at the end of its range: set the zero position of the drive";
        }
        start_ = monotonic_now();
        late_from_ = start_;
        take(answer);
        return "";
    }

    /// Compares mode and ranges of a Damiao drive with the preset, and sets its watchdog.
    [[nodiscard]] std::string set_up_damiao() {
        struct Entry {
            std::uint8_t address;
            const char* name;
            double value;
        };
        const mit::Ranges& ranges = settings_.preset.ranges;
        if (register_answer(read_register, 10, 0) != 1U) {
            return "is not in the MIT mode: set its register 10 (CTRL_MODE) to 1";
        }
        for (const Entry& range :
             {Entry{21, "PMAX", ranges.position}, {22, "VMAX", ranges.velocity}, {23, "TMAX", ranges.torque}}) {
            const std::optional<std::uint32_t> bits = register_answer(read_register, range.address, 0);
            const double found = bits ? std::bit_cast<float>(*bits) : std::numeric_limits<double>::quiet_NaN();
            if (!(std::abs(found - range.value) <= 1e-3 * range.value)) {
                return std::string("has ") + range.name + " = " + readable(found) + ", but " +
                       std::string(settings_.preset.name) + " has " + readable(range.value) +
                       ": choose the kind of the drive";
            }
        }
        const auto watchdog = static_cast<std::uint32_t>(std::lround(settings_.watchdog_s / 50e-6));
        if (register_answer(write_register, 9, watchdog) != watchdog) {
            return "does not accept its watchdog: its register 9 (TIMEOUT) must be writable";
        }
        return "";
    }

    [[nodiscard]] bool has_fault(const mit::Answer& answer) const noexcept {
        const bool enabled = settings_.preset.maker == mit::Maker::Damiao && settings_.makes_force;
        return answer.state != (enabled ? enabled_state : 0);
    }

    void take(const mit::Answer& answer) noexcept {
        last_.position = answer.position;
        last_.velocity = answer.velocity;
        last_.applied = -answer.torque;
        last_.device_time = static_cast<double>(monotonic_now() - start_) * 1e-9;
        ++last_.sequence;
    }

    /// Reads the answers that arrived since the last exchange. Returns false if a second drive answers.
    [[nodiscard]] bool discard_waiting() noexcept {
        bool repeated = false;
        for (mit::Frame bytes{}; next_frame(bytes, 0);) {
            if (allowed_late_ > 0) {
                --allowed_late_;
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
        const mit::Line line = settings_.makes_force
                                   ? mit::line_of(is_alone ? command : Command{}, settings_.preset.ranges)
                                   : mit::Line{mit::disable_frame, false};
        const Nanoseconds sent = monotonic_now();
        const Sent result = send(line.frame);
        if (result != Sent::Yes) {
            ++health_.unsent;
        } else if (awaited_++ == 0) {
            oldest_unanswered_ = sent;
        }
        mit::Answer answer;
        const bool answered = result == Sent::Yes && next_answer(answer, sent + settings_.wait);
        const Nanoseconds now = monotonic_now();
        last_.delay = static_cast<double>(now - late_from_) * 1e-9;
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
        if (!is_alone || has_fault(answer) || answer.at_end) {
            return Status::Fault;
        }
        return line.is_limited ? Status::Limited : Status::Ok;
    }

    MitSettings settings_;
    Bus bus_;
    MitHealth health_;
    Reading last_;
    bool is_open_ = false;
    bool is_faulty_ = false;         ///< true after a fault: only zero torque is sent
    int awaited_ = 0;                ///< commands since the last answer
    int allowed_late_ = 0;           ///< answers that may still arrive late
    int repeated_in_a_row_ = 0;      ///< successive exchanges with an answer without a command
    Nanoseconds start_ = 0;          ///< time of the first reading [ns]
    Nanoseconds late_from_ = 0;      ///< earliest time of the state that the newest applied force does not contain
    Nanoseconds oldest_unanswered_ = 0;  ///< time at which the oldest command without an answer was sent [ns]
};

static_assert(Device<MitDevice<>>);

}  // namespace palpate
