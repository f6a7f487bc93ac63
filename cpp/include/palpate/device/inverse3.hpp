// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <nlohmann/json.hpp>

#include "palpate/device/device.hpp"
#include "palpate/device/inverse3_messages.hpp"
#include "palpate/device/web_socket.hpp"

namespace palpate {

/// Network address of the Inverse Service that controls a Haply Inverse3, and the axis along which its handle moves.
struct Inverse3Settings {
    std::string host = "127.0.0.1";
    std::uint16_t port = 10001;
    int axis = 2;                                  ///< 0 = x, 1 = y, 2 = z
    double direction = 1.0;                        ///< +1 or -1: direction of a press along the axis
    std::chrono::milliseconds step_timeout{2000};  ///< longest wait in each step of opening the device
    /// Longest wait of a tick for the service's message with position and force
    std::chrono::milliseconds answer_timeout{20};
};

/// One direction of a Haply Inverse3, Inverse3x or Minverse, through the Inverse Service of its maker: JSON over a
/// local WebSocket. This class was never tried on hardware; the tests replace the service by a server that uses the
/// same messages.
///
/// The documentation of version 3.5 defines (docs.haply.co/inverseSDK/service: "WebSocket Protocol", "Control
/// Commands", "Common Types", "JSON Conventions", "Device Configuration", "Filters", tutorials 01 and 05):
/// - ws://localhost:10001. On connection the service sends every device with config, state and status. After that it
///   sends one message with the device's state for each received message, so the host sets the rate of the loop.
/// - inverse3[].device_id; state.cursor_position in m, cursor_velocity in m/s, current_cursor_force in N, each {x, y,
///   z} of a right-handed frame; status.calibrated.
/// - inverse3[].commands.set_cursor_force.vector in N. Each command acts once; if the host sends no more
///   commands, the device makes no force.
///   session.configure.profile.name is in the first message only.
/// - inverse3[].configure.force_gate.gain, .damping.scalar and .damping.vector set two filters of forces for the
///   session. session.force_render_full_state requests one answer with config.filters, which `open` reads back. An
///   automatic reduction of forces at oscillations and a global scale of forces cannot be set for a session.
///
/// Joint torques (set_angular_torques) are not used: a force along one axis needs the kinematics of the arm, which are
/// not published. Older versions of the service name the vector `values` and ignore unknown keys. If the received state shows zero
/// force for more than 200 consecutive commands of a force, the exchange therefore returns the status Fault.
///
/// Position 0 is the position of the handle on opening. The service does not send its time, so device_time is the
/// host's time at the end of the exchange. A state is at most as old as the command that it answers, and a command acts
/// before its answer arrives: Reading::delay is the time from sending a command until the answer to the next one, which
/// is computed from the first one's state. States that the service sends without a command are skipped, so that the
/// reading is the newest state; a command may then have acted only when they were found, which the delay contains. An
/// exchange parses JSON and therefore allocates memory.
///
/// After a message that differs from the documentation, each exchange returns Fault and sends zero force as long as the
/// connection lives.
class Inverse3Device {
  public:
    explicit Inverse3Device(Inverse3Settings settings = {}) : settings_{std::move(settings)} {}

    /// Connects to the service, chooses the device, sets its filters of forces to 0 and reads them and the position.
    Opened open() {
        link_ = std::make_unique<Link>();
        const std::string service = settings_.host + ":" + std::to_string(settings_.port);
        try {
            connect(service);
            receive(service, "reports no device");
            info_ = read_inverse3_inventory(link_->newest_message, service);
            begin_session(service);
        } catch (const nlohmann::json::exception& error) {
            link_.reset();
            return {"the program at " + service +
                    " is not a Haply Inverse Service: " + escaped(error.what())};
        } catch (const std::exception& error) {
            link_.reset();
            return {error.what()};
        }
        return {};
    }

    /// Sends the force command and waits for the device's state that answers the command. If an answer is late, the
    /// next exchange reads it together with the answer to its command.
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        last_.status = Status::Fault;
        if (link_ && link_->socket.is_open()) {
            try {
                last_.status = exchanged(std::isfinite(command.force) ? command.force : 0.0);
            } catch (const std::exception&) {
                link_->is_wrong = true;
            }
        }
        if (!link_ || !link_->socket.is_open()) {
            last_.applied = 0.0;
        }
        return last_;
    }

    /// Sends zero force until the service reports it, then closes the connection.
    ZeroForce close() noexcept {
        if (!link_) {
            return ZeroForce::Confirmed;
        }
        ZeroForce zero_force = ZeroForce::NotSent;
        try {
            zero_force = end_force();
            link_->socket.close(after(std::chrono::milliseconds{200}));
        } catch (const std::exception&) {
        }
        link_.reset();
        return zero_force;
    }

    /// Returns the number of states that the service sent without a command, and that were skipped.
    [[nodiscard]] std::uint64_t skipped_states() const noexcept { return skipped_states_; }
    [[nodiscard]] const Inverse3Info& info() const noexcept { return info_; }

  private:
    /// Returns the time at which a wait ends.
    [[nodiscard]] static Nanoseconds after(std::chrono::nanoseconds wait,
                                           Nanoseconds start = monotonic_now()) noexcept {
        return start + wait.count();
    }

    /// A connection to the service, and what was sent and received.
    struct Link {
        WebSocket socket;
        std::string message;                 ///< message to the service that was sent last
        std::string command_head;            ///< start of each command's text, up to the force
        bool is_wrong = false;               ///< true after a message that differs from the documentation
        int unanswered = 0;                  ///< sent messages that the service has not answered
        std::string newest_message;          ///< message that the service sent last
        Nanoseconds sent = monotonic_now();  ///< time at which the last command was sent
        /// Earliest time of the first state that the force of the device does not take into account, now and before the
        /// last answer
        Nanoseconds late_from = 0, late_from_before = 0;
        Inverse3State state;  ///< state that was read last
        double origin = 0.0;  ///< handle position when the device was opened [m]
        /// Number of consecutive exchanges in which the service reports zero force although a force was commanded
        int states_without_effect = 0;
        Nanoseconds start = monotonic_now();

        /// Receives the next message of the service, which answers the oldest unanswered one. Returns false without it.
        [[nodiscard]] bool receive(Nanoseconds until) {
            const bool received = socket.receive(newest_message, until);
            unanswered = std::max(unanswered - (received ? 1 : 0), 0);
            return received;
        }
    };

    /// A commanded force above this limit counts as without effect if the service reports zero force [N]
    static constexpr double least_visible_force = 0.05;
    static constexpr int most_states_without_effect = 200;

    /// Connects to the service. Throws an error with the likely cure if no service answers.
    void connect(const std::string& service) {
        const std::string reason =
            link_->socket.open(settings_.host, settings_.port, after(settings_.step_timeout));
        if (!reason.empty()) {
            throw std::runtime_error("no Haply Inverse Service answers at " + service + " (" + reason +
                                     "): start Haply Hub, or the service itself");
        }
    }

    /// Waits for the next message of the service while the device is being opened.
    void receive(const std::string& service, const char* failure) {
        if (!link_->receive(after(settings_.step_timeout))) {
            throw std::runtime_error("the Haply Inverse Service at " + service + " " + failure +
                                     (link_->socket.is_open() ? "" : ": it ended the connection"));
        }
    }

    /// Sends the name of this program and the filters, then a request of the configuration, each with zero force. Takes
    /// the filters and the start position of the handle from the last answer.
    void begin_session(const std::string& service) {
        link_->command_head = inverse3_command_head(info_.id, inverse3_without_filters);
        request(service, R"({"session":{"configure":{"profile":{"name":"palpate"}}},)");
        link_->command_head = inverse3_command_head(info_.id);
        request(service, R"({"session":{"force_render_full_state":{}},)");
        read_inverse3_filters(link_->newest_message, info_);
        link_->late_from = link_->late_from_before = link_->sent;
        read_state();
        link_->origin = link_->state.position;
        last_ = {};
        skipped_states_ = 0;
    }

    /// Sends a message with zero force and waits for the answer, while the device is being opened.
    void request(const std::string& service, const char* head) {
        send_command(0.0, head, settings_.step_timeout);
        receive(service, "does not answer a command");
    }

    /// Sends a message with a force command to the service.
    void send_command(double force, const char* head, std::chrono::milliseconds within) {
        write_inverse3_command(link_->message, head, link_->command_head, settings_.axis,
                               -settings_.direction * force);
        ++link_->unanswered;
        link_->sent = monotonic_now();
        link_->socket.send(link_->message, after(within, link_->sent));
    }

    /// Sends a force command and waits for the answer of the service. Returns false without an answer.
    bool is_answered(double force) {
        send_command(force, "{", settings_.answer_timeout);
        const Nanoseconds until = after(settings_.answer_timeout, link_->sent);
        while (link_->unanswered > 0 && link_->receive(until)) {
        }
        return link_->unanswered == 0;
    }

    /// Reads the messages that arrived since the last exchange. Returns true if one of them answers no command.
    bool skip_waiting_states() {
        const std::uint64_t before = skipped_states_;
        const Nanoseconds until = after(settings_.answer_timeout);
        for (Nanoseconds now = monotonic_now(); now < until; now = monotonic_now()) {
            const bool is_answer = link_->unanswered > 0;
            if (!link_->receive(now)) {
                break;
            }
            skipped_states_ += is_answer ? 0 : 1;
        }
        return skipped_states_ != before;
    }

    /// Sends a force command and waits for the service's next message with the position. Returns the tick's status.
    [[nodiscard]] Status exchanged(double force) {
        Link& link = *link_;
        const bool has_skipped = skip_waiting_states();
        const bool answered = is_answered(link.is_wrong ? 0.0 : force);
        if (!link.socket.is_open() || link.is_wrong) {
            return Status::Fault;
        }
        read_state();
        const auto seconds = [](Nanoseconds time) { return 1e-9 * static_cast<double>(time); };
        const Nanoseconds now = monotonic_now();
        // A skipped state can be the answer to the last command; the one read before it is then older.
        last_.delay = seconds(now - (has_skipped ? link.late_from_before : link.late_from));
        if (answered) {
            link.late_from_before = std::exchange(link.late_from, link.sent);
        }
        last_.position = settings_.direction * (link.state.position - link.origin);
        last_.velocity = settings_.direction * link.state.velocity;
        last_.applied = -settings_.direction * link.state.force;
        last_.device_time = seconds(now - link.start);
        last_.sequence += answered ? 1 : 0;
        link.states_without_effect = std::abs(force) > least_visible_force && link.state.force == 0.0
                                         ? link.states_without_effect + 1
                                         : 0;
        if (link.states_without_effect > most_states_without_effect) {
            return Status::Fault;
        }
        return answered ? Status::Ok : Status::Timeout;
    }

    /// Sends zero force until the service reports it, at most for the longest wait of an answer.
    [[nodiscard]] ZeroForce end_force() {
        const Nanoseconds until = after(settings_.answer_timeout);
        for (bool answered = true; answered && monotonic_now() < until;) {
            (void)skip_waiting_states();
            answered = is_answered(0.0);
            if (answered && reports_zero_force()) {
                return ZeroForce::Confirmed;
            }
        }
        return link_->socket.is_open() ? ZeroForce::Sent : ZeroForce::NotSent;
    }

    /// Returns true if the newest message of the service is a state of this device without a force.
    [[nodiscard]] bool reports_zero_force() {
        try {
            read_state();
        } catch (const std::exception&) {
            return false;
        }
        return std::abs(link_->state.force) < least_visible_force;
    }

    /// Reads position, velocity and force from the newest message of the service. Throws if the message differs from
    /// the service's documentation, or does not contain this device.
    void read_state() { link_->state = read_inverse3_state(link_->newest_message, info_.id, settings_.axis); }

    Inverse3Settings settings_;
    Inverse3Info info_;
    std::unique_ptr<Link> link_;
    Reading last_;
    std::uint64_t skipped_states_ = 0;
};

static_assert(Device<Inverse3Device>);

/// Reads the part after "inverse3" of a device's name: empty, ":AXIS" or ":AXIS@PORT", with AXIS one of x, y, z, -x,
/// -y, -z. Throws std::invalid_argument with the valid form.
[[nodiscard]] inline Inverse3Settings inverse3_settings(const std::string& text) {
    Inverse3Settings settings;
    const std::size_t at = text.find('@');
    const std::string axis = text.empty() ? "z" : text.substr(1, at == std::string::npos ? at : at - 1);
    const std::string letter = axis.starts_with('-') ? axis.substr(1) : axis;
    const std::size_t axis_index = std::string_view{"xyz"}.find(letter);
    int port = settings.port;
    bool is_valid =
        (text.empty() || text.front() == ':') && letter.size() == 1 && axis_index != std::string::npos;
    if (is_valid && at != std::string::npos) {
        const char* first = text.data() + at + 1;
        const char* last = text.data() + text.size();
        const auto [end, error] = std::from_chars(first, last, port);
        is_valid = end == last && error == std::errc{} && port > 0 && port < 65536;
    }
    if (!is_valid) {
        throw std::invalid_argument(
            "device is 'inverse3" + text +
            "', must be inverse3[:AXIS[@PORT]]: AXIS is x, y, z, -x, -y or -z, PORT is the TCP port of the "
            "Inverse Service (" +
            std::to_string(Inverse3Settings{}.port) + ")");
    }
    settings.axis = static_cast<int>(axis_index);
    settings.direction = axis.starts_with('-') ? -1.0 : 1.0;
    settings.port = static_cast<std::uint16_t>(port);
    return settings;
}

}  // namespace palpate
