// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
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

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <nlohmann/json.hpp>

#include "palpate/device/device.hpp"

namespace palpate {

/// Address of an Inverse3, and the direction that is used as handle.
struct Inverse3Settings {
    std::string host = "127.0.0.1";
    std::uint16_t port = 10001;
    int axis = 2;                                  ///< 0 = x, 1 = y, 2 = z
    double direction = 1.0;                        ///< +1 or -1: sign of the direction into the object
    std::chrono::milliseconds step_timeout{2000};  ///< for each step of opening
    std::chrono::milliseconds answer_timeout{20};  ///< then the exchange is a Timeout
};

/// Properties of the device that the service stated on opening.
struct Inverse3Info {
    std::string id;           ///< short identifier, such as 049D
    std::string type;         ///< inverse3, inverse3x, minverse
    double force_gate = 0.0;  ///< service's reduction of forces during oscillation: gain [-]
    double damping = 0.0;     ///< damping that the service adds: scalar
};

/// One direction of a Haply Inverse3, Inverse3x or Minverse, through the Inverse Service of its maker: JSON over a
/// local WebSocket. It was never tried on hardware; a test server that uses these messages replaces the service.
///
/// The documentation of version 3.5 defines (docs.haply.co/inverseSDK/service: "WebSocket Protocol", "Control
/// Commands", "Common Types", "JSON Conventions", "Filters", tutorials 01 and 05):
/// - ws://localhost:10001. On connection the service sends every device with config, state and status. After that it
///   sends one message of states for each message that it receives, so the host paces the device.
/// - inverse3[].device_id; state.cursor_position in m, cursor_velocity in m/s, current_cursor_force in N, each {x, y,
///   z} of a right-handed frame; status.calibrated.
/// - inverse3[].commands.set_cursor_force.vector in N. It acts once, so a silent host gets an idle device.
///   session.configure.profile.name is in the first message only.
/// - config.filters.force_gate.gain and .damping.scalar. Forces pass both filters and a global scale.
///
/// Older versions name the vector `values` and ignore unknown keys. If the state never shows an effect of a force, the
/// exchange therefore ends in a Fault.
///
/// Position 0 is the position of the handle on opening. The service does not send its time, so device_time is the
/// host's time at the answer. An exchange parses JSON and therefore allocates memory.
class Inverse3Device {
  public:
    explicit Inverse3Device(Inverse3Settings settings = {}) : settings_{std::move(settings)} {}

    /// Connects to the service, chooses the device and reads its position.
    Opened open() {
        link_ = std::make_unique<Link>();
        const std::string service = settings_.host + ":" + std::to_string(settings_.port);
        try {
            connect(service);
            const Json inventory = Json::parse(received(service, "reports no device"));
            read_inventory(inventory, service);
            begin_session(service);
        } catch (const Json::exception& error) {
            link_.reset();
            return {"the program at " + service + " is not a Haply Inverse Service: " + error.what()};
        } catch (const std::exception& error) {
            link_.reset();
            return {error.what()};
        }
        return {};
    }

    /// Sends the command and waits for the state that answers it. A late answer is read by the next exchange, together
    /// with the next one.
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        if (!link_ || link_->disconnected) {
            last_.status = Status::Fault;
            last_.applied = 0.0;
            return last_;
        }
        try {
            last_.status = exchanged(std::isfinite(command.force) ? command.force : 0.0);
        } catch (const std::exception&) {
            link_->disconnected = true;
            last_.status = Status::Fault;
        }
        return last_;
    }

    /// Closes the connection.
    void close() noexcept {
        if (!link_) {
            return;
        }
        try {
            if (!link_->disconnected) {
                bool closed = false;
                link_->stream.async_close(boost::beast::websocket::close_code::normal,
                                          [&closed](const Error& /*any*/) { closed = true; });
                link_->run(std::chrono::milliseconds{200}, [&closed] { return closed; });
            }
        } catch (const std::exception&) {
            link_->disconnected =
                true;  // the force command ended before: the service sets a device without messages to idle
        }
        link_.reset();
    }

    [[nodiscard]] const Inverse3Info& info() const noexcept { return info_; }
    [[nodiscard]] const Inverse3Settings& settings() const noexcept { return settings_; }

  private:
    using Json = nlohmann::json;
    using Error = boost::system::error_code;

    /// A connection and its pending operations. Its address must not change, because handlers store it.
    struct Link {
        boost::asio::io_context context;
        boost::beast::websocket::stream<boost::beast::tcp_stream> stream{context};
        boost::beast::flat_buffer buffer;
        std::string message;       ///< in transmission
        std::string command_head;  ///< of every message after the first, up to the numbers
        bool sending = false;
        bool reading = false;
        bool disconnected = false;
        int unanswered = 0;     ///< messages without a state so far
        double position = 0.0;  ///< of the axis, as the service states it [m]
        double origin = 0.0;
        double velocity = 0.0;
        double echoed = 0.0;  ///< current force along the axis, as the service states it [N]
        std::uint64_t sequence = 0;
        int states_without_effect = 0;  ///< consecutive states without an effect of the force
        std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();

        /// Runs handlers, which run only here. Returns true if `done` became true in time.
        template <class Done>
        bool run(std::chrono::milliseconds within, Done done) {
            const auto until = std::chrono::steady_clock::now() + within;
            context.restart();
            while (!done() && context.run_one_until(until) > 0) {
            }
            return done();
        }
    };

    static constexpr double least_visible_force = 0.05;  ///< least force whose effect the state must show [N]
    static constexpr int most_states_without_effect = 200;

    /// Connects to the service. Throws with the likely cure.
    void connect(const std::string& service) {
        const auto refuse = [&](const std::string& reason) {
            throw std::runtime_error("no Haply Inverse Service answers at " + service + " (" + reason +
                                     "): start Haply Hub, or the service itself");
        };
        Error error;
        const auto address = boost::asio::ip::make_address(settings_.host, error);
        if (error) {
            refuse("'" + settings_.host + "' is not an address");
        }
        bool done = false;
        const auto finished = [&](const Error& result) {
            error = result;
            done = true;
        };
        const auto await = [&] {
            if (!link_->run(settings_.step_timeout, [&done] { return done; })) {
                refuse("no answer");
            }
            if (error) {
                refuse(error.message());
            }
            done = false;
        };
        boost::beast::get_lowest_layer(link_->stream).async_connect({address, settings_.port}, finished);
        await();
        boost::beast::get_lowest_layer(link_->stream)
            .socket()
            .set_option(boost::asio::ip::tcp::no_delay{true});
        link_->stream.async_handshake(service, "/", finished);
        await();
    }

    /// Returns the next message during opening.
    [[nodiscard]] std::string received(const std::string& service, const char* failure) {
        bool done = false;
        Error error;
        link_->stream.async_read(link_->buffer, [&](const Error& result, std::size_t /*size*/) {
            error = result;
            done = true;
        });
        if (!link_->run(settings_.step_timeout, [&done] { return done; }) || error) {
            throw std::runtime_error("the Haply Inverse Service at " + service + " " + failure +
                                     (error ? ": " + error.message() : ""));
        }
        std::string text = boost::beast::buffers_to_string(link_->buffer.data());
        link_->buffer.clear();
        return text;
    }

    /// Reads the first device of the first message. Throws if there is none or it is not calibrated.
    void read_inventory(const Json& inventory, const std::string& service) {
        const Json none = Json::array();
        const Json& devices = inventory.contains("inverse3") ? inventory.at("inverse3") : none;
        if (devices.empty()) {
            throw std::runtime_error("the Haply Inverse Service at " + service +
                                     " detects no Inverse3: plug it in, and check that Haply Hub shows it");
        }
        const Json& device = devices.at(0);
        info_.id = device.at("device_id").get<std::string>();
        const Json& config = device.at("config");
        info_.type = config.value("type", "inverse3");
        const Json filters = config.value("filters", Json::object());
        info_.force_gate = filters.value(Json::json_pointer{"/force_gate/gain"}, 0.0);
        info_.damping = filters.value(Json::json_pointer{"/damping/scalar"}, 0.0);
        if (!device.value(Json::json_pointer{"/status/calibrated"}, true)) {
            throw std::runtime_error(
                "Inverse3 " + info_.id +
                " is not calibrated: follow the instructions of its light or of Haply Hub");
        }
        link_->command_head = R"("inverse3":[{"device_id":)" + Json(info_.id).dump() +
                              R"(,"commands":{"set_cursor_force":{"vector":{)";
    }

    /// Sends the first message, which names the program and has zero force. Its answer contains the position of the
    /// handle.
    void begin_session(const std::string& service) {
        write_message(0.0, R"({"session":{"configure":{"profile":{"name":"palpate"}}},)");
        Error error;
        link_->stream.write(boost::asio::buffer(link_->message), error);
        take_state(received(service, "does not answer a command"));
        link_->origin = link_->position;
        last_ = {};
        last_.sequence = link_->sequence;
    }

    /// Writes a command into the message that is sent next.
    void write_message(double force, const char* head) {
        std::string& text = link_->message;
        text.assign(head).append(link_->command_head);
        for (int k = 0; k < 3; ++k) {
            text += k > 0 ? "," : "";
            text += axis_keys[static_cast<std::size_t>(k)];
            std::array<char, 32> digits{};
            const double along = k == settings_.axis ? -settings_.direction * force : 0.0;
            text.append(digits.data(),
                        std::to_chars(digits.data(), digits.data() + digits.size(), along).ptr);
        }
        text += "}}}}]}";
    }

    /// Sends a command and waits for its state. Returns the status of the exchange.
    [[nodiscard]] Status exchanged(double force) {
        Link& link = *link_;
        if (!link.sending) {  // at most one command in transmission
            write_message(force, "{");
            link.sending = true;
            ++link.unanswered;
            link.stream.async_write(boost::asio::buffer(link.message),
                                    [&link](const Error& error, std::size_t /*size*/) {
                                        link.sending = false;
                                        link.disconnected = link.disconnected || error;
                                    });
        }
        read_next();
        const bool answered = link.run(settings_.answer_timeout, [&link] {
            return link.disconnected || (!link.sending && link.unanswered == 0);
        });
        if (link.disconnected) {
            return Status::Fault;
        }
        last_.position = settings_.direction * (link.position - link.origin);
        last_.velocity = settings_.direction * link.velocity;
        last_.applied = -settings_.direction * link.echoed;
        last_.device_time =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - link.start).count();
        last_.sequence = link.sequence;
        link.states_without_effect =
            std::abs(force) > least_visible_force && link.echoed == 0.0 ? link.states_without_effect + 1 : 0;
        if (link.states_without_effect > most_states_without_effect) {
            return Status::Fault;
        }
        return answered ? Status::Ok : Status::Timeout;
    }

    /// Starts reading the next message, until all messages have their state.
    void read_next() {
        Link& link = *link_;
        if (link.reading || link.disconnected || link.unanswered == 0) {
            return;
        }
        link.reading = true;
        link.stream.async_read(link.buffer, [this, &link](const Error& error, std::size_t /*size*/) {
            link.reading = false;
            link.disconnected = link.disconnected || error;
            if (link.disconnected) {
                return;
            }
            take_state(boost::beast::buffers_to_string(link.buffer.data()));
            link.buffer.clear();
            --link.unanswered;
            read_next();
        });
    }

    /// Reads a state. Throws if the message differs from the documentation, or does not contain this device.
    void take_state(const std::string& text) {
        const Json message = Json::parse(text);
        for (const Json& device : message.at("inverse3")) {
            if (device.at("device_id").get_ref<const std::string&>() == info_.id) {
                const Json& state = device.at("state");
                const std::string key(1, axis_names[static_cast<std::size_t>(settings_.axis)]);
                link_->position = state.at("cursor_position").at(key).get<double>();
                link_->velocity = state.at("cursor_velocity").at(key).get<double>();
                link_->echoed = state.at("current_cursor_force").at(key).get<double>();
                ++link_->sequence;
                return;
            }
        }
        throw std::runtime_error("Inverse3 " + info_.id + " is missing in the state");
    }

    static constexpr std::string_view axis_names = "xyz";
    static constexpr std::array<const char*, 3> axis_keys{R"("x":)", R"("y":)", R"("z":)"};

    Inverse3Settings settings_;
    Inverse3Info info_;
    std::unique_ptr<Link> link_;
    Reading last_;
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
        throw std::invalid_argument("device is 'inverse3" + text +
                                    "', must be inverse3[:AXIS[@PORT]], AXIS of x, y, z, -x, -y, -z");
    }
    settings.axis = static_cast<int>(axis_index);
    settings.direction = axis.starts_with('-') ? -1.0 : 1.0;
    settings.port = static_cast<std::uint16_t>(port);
    return settings;
}

}  // namespace palpate
