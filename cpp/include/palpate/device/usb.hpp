// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "palpate/device/detail/usb_connection.hpp"
#include "palpate/device/detail/usb_transfers.hpp"
#include "palpate/device/device.hpp"
#include "palpate/device/device_profile.hpp"
#include "palpate/device/packet_stream.hpp"
#include "palpate/device/wire.hpp"

namespace palpate {

/// Settings of the connection to a USB device.
struct UsbOptions {
    std::string serial;                     ///< serial number of the device; empty: the only one connected
    std::chrono::microseconds wait{5'000};  ///< longest time that a tick waits for a packet
    std::uint16_t time_to_live_ms = 10;  ///< the device ends its torque if no command arrives for this time
    bool makes_force = true;             ///< false: the motor is never enabled; the device only sends samples
    /// True: the device renders its own model. The commands only keep it active; their force has no effect.
    bool device_renders = false;
    /// With `device_renders`: fingerprints and rate of the model that the device must contain; unset: any model
    std::optional<wire::DeviceModel> model = std::nullopt;
};

/// Counters of the packets and USB transfers of a device.
struct UsbHealth {
    StreamHealth stream;
    /// Commands not sent, because the previous command was in flight or a newer sample had arrived.
    std::uint64_t skipped_commands = 0;
    std::uint64_t lost_commands = 0;  ///< commands that did not arrive at the device
    std::uint64_t timeouts = 0;       ///< ticks in which no packet arrived before the deadline
    /// Received packets discarded unread, after opening or because the host was late
    std::uint64_t discarded = 0;
    std::uint64_t stalls = 0;      ///< number of times a USB endpoint halted
    std::uint64_t bus_errors = 0;  ///< USB transfers that failed on the bus
};

/// A haptic device of one degree of freedom over USB; device/wire.hpp defines packets and signs.
///
/// The packets of the device set the rate of the control loop. An exchange sends its command, then waits for the next
/// packet, usually at most `UsbOptions::wait`. If the host is late by up to 4 packets, it processes all of them, and
/// skips the commands for old packets, but not two in a row. If more than 4 packets wait, the host discards them. After
/// opening and after discarded packets, the first exchange sends no command if a packet arrives within two periods, so
/// that commands are sent directly after a packet. An exchange does not throw. It allocates only within libusb, which
/// uses its own locks; the wait uses a futex.
///
/// Reading::status:
/// - Timeout: no packet arrived, or the device's watchdog ended the torque.
/// - Fault: the device reported a fault, was disabled or was unplugged. The control loop ends after this status.
/// - Lost: a command could not be sent, did not arrive, or was not understood by the device.
/// - Limited: the device limited the torque of a command.
///
/// Reading::sequence, the number of the sample, shows lost and repeated samples; Reading::delay late and ignored
/// commands.
class UsbDevice {
  public:
    static constexpr bool paces_host = true;

    explicit UsbDevice(UsbOptions options = {}) : options_{std::move(options)} {}
    UsbDevice(UsbDevice&&) noexcept = default;
    UsbDevice& operator=(UsbDevice&&) = delete;
    ~UsbDevice() { (void)close(); }

    /// Finds the device and starts its packets. Enables the device's torque if `UsbOptions::makes_force` is set. The
    /// torque is zero until the first exchange.
    Opened open() {
        (void)close();
        open_ = std::make_unique<OpenDevice>();
        std::string reason = open_->connection.open(options_.serial).reason;
        if (reason.empty()) {
            reason = start();
            if (!reason.empty()) {
                reason = name().text() + " " + reason;
            }
        }
        if (!reason.empty()) {
            const UsbName tried = name();
            (void)close();
            last_name_ = tried;
        }
        return {reason};
    }

    /// Sends the force command and waits for the device's next sample.
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        if (open_ == nullptr) {
            return failed(Status::Fault);
        }
        const Nanoseconds deadline = monotonic_now() + std::chrono::nanoseconds{options_.wait}.count();
        // After discarded packets no command is sent before the next packet. If no packet arrives, the exchange still
        // sends a command.
        const bool is_reference = restarted() && next_packet(monotonic_now() + 2 * open_->frame);
        if (!is_reference) {
            send_or_skip(command.force, deadline);
        }
        if (is_reference || next_packet(deadline)) {
            const Reading reading = with_loss_status(open_->stream.reading());
            open_->reading_is_valid = sends_force(reading.status);
            return reading;
        }
        open_->reading_is_valid = false;
        if (open_->transfers->has_failed()) {
            return failed(Status::Fault);
        }
        ++open_->timeouts;
        return failed(Status::Timeout);
    }

    /// Sends zero torque, disables the device, ends all USB transfers and releases the device, in this order. Steps to
    /// which the device does not respond are skipped. The device confirms zero force by accepting the request that
    /// disables it.
    ZeroForce close() noexcept {
        if (open_ == nullptr) {
            return ZeroForce::Confirmed;
        }
        const ZeroForce zero_force =
            open_->transfers == nullptr ? ZeroForce::NotSent : send_zero_and_disable();
        last_name_ = name();
        last_info_ = info();
        last_health_ = health();
        if (open_->transfers != nullptr) {
            open_->transfers->stop();
        }
        open_.reset();
        return zero_force;
    }

    // name(), info() and health() describe the open USB device, or after closing the USB device that was open last.
    [[nodiscard]] const UsbName& name() const noexcept {
        return open_ == nullptr ? last_name_ : open_->connection.name();
    }
    [[nodiscard]] const wire::Info& info() const noexcept {
        return open_ == nullptr ? last_info_ : open_->connection.info();
    }
    [[nodiscard]] UsbHealth health() const noexcept {
        if (open_ == nullptr) {
            return last_health_;
        }
        UsbHealth health;
        health.stream = open_->stream.health();
        health.skipped_commands = open_->skipped_commands;
        health.timeouts = open_->timeouts;
        health.discarded = open_->discarded;
        if (open_->transfers != nullptr) {
            health.lost_commands = open_->transfers->lost_writes();
            health.stalls = open_->transfers->stalls();
            health.bus_errors = open_->transfers->bus_errors();
        }
        return health;
    }
    /// Returns the number of USB transfers that have not ended.
    [[nodiscard]] int in_flight() const noexcept {
        return open_ == nullptr || open_->transfers == nullptr ? 0 : open_->transfers->in_flight();
    }

    /// Returns the model that the open device can render itself; nothing without such a model.
    [[nodiscard]] std::optional<wire::DeviceModel> model() const {
        return open_ == nullptr ? std::nullopt : open_->connection.model();
    }

    /// Returns a device profile from the properties that the device reports. Its inertia has the default value, and
    /// damping and friction are 0, because a device does not report them.
    [[nodiscard]] DeviceProfile profile() const {
        DeviceProfile profile = unmeasured({});
        profile.id = name().serial.empty() ? name().product : name().serial;
        profile.period_s = 1.0 / info().rate_hz;
        profile.encoder_step = wire::position_of(1, info().counts_per_rev);
        profile.force_step = 1e-6;
        // Divided by 1e6, not multiplied by 1e-6: 1e-6 is itself a rounded number
        profile.force_limit = info().max_torque_uNm / 1e6;
        return profile;
    }

  private:
    /// If more than this number of received packets wait to be read, the host discards all of them
    static constexpr std::size_t most_waiting_packets = 4;
    static constexpr int most_kept_packets = 2;  ///< number of old packets discarded on opening
    static constexpr Nanoseconds first_packet_timeout = nanoseconds_a_second;
    static constexpr Nanoseconds write_timeout = nanoseconds_a_second / 50;

    static constexpr const char* clear_cure =
        "run 'palpate devices --clear' to clear the fault of the device, then try again";

    /// The connection, packets and counters of an open device.
    struct OpenDevice {
        detail::UsbConnection connection;
        PacketStream stream;
        std::unique_ptr<detail::UsbTransfers> transfers;
        Nanoseconds frame = 0;
        Nanoseconds arrived = 0;  ///< arrival time of the last packet [ns]
        bool skipped_last = false;
        bool sent_last = true;
        bool reading_is_valid = true;  ///< true if the last reading was valid
        std::uint64_t skipped_commands = 0;
        std::uint64_t lost_commands = 0;
        std::uint64_t timeouts = 0;
        std::uint64_t discarded = 0;
    };

    /// Starts the packets of the device and, if `makes_force` is set, enables its torque. Returns "", or a sentence
    /// with the reason and the cure.
    [[nodiscard]] std::string start() {
        detail::UsbConnection& connection = open_->connection;
        open_->stream = PacketStream{connection.info()};
        open_->frame = nanoseconds_a_second / connection.info().rate_hz;
        if (const int code = connection.request(wire::Request::Enable, 0); code != 0) {
            return "cannot be disabled: " + detail::usb_reason(code);
        }
        if (options_.device_renders) {
            if (std::string reason = choose_device_renderer(); !reason.empty()) {
                return reason;
            }
        }
        open_->transfers = std::make_unique<detail::UsbTransfers>(connection.context(), connection.handle());
        if (const int code = open_->transfers->start(); code != 0) {
            return "does not stream: " + detail::usb_reason(code);
        }
        const Nanoseconds deadline = monotonic_now() + first_packet_timeout;
        if (!discard_packets(most_kept_packets, deadline) || !next_packet(deadline)) {
            return open_->transfers->has_failed()
                       ? "does not stream: " + detail::usb_reason(open_->transfers->error())
                       : "sends no packets; unplug the device and plug it in again";
        }
        if ((open_->stream.status_bits() & wire::fault_bits) != 0) {
            return "reports " + fault_text(open_->stream.status_bits()) +
                   "; remove the cause of the fault, then " + clear_cure;
        }
        if (!options_.makes_force) {
            return "";
        }
        if (const int code = open_->transfers->request(wire::Request::Enable, 1); code != 0) {
            return "cannot be enabled: " + (code == LIBUSB_ERROR_PIPE
                                                ? std::string("the device refuses the request; ") + clear_cure
                                                : detail::usb_reason(code));
        }
        while ((open_->stream.status_bits() & wire::enabled) == 0) {
            if (!next_packet(deadline)) {
                return std::string("does not enable its torque; ") + clear_cure;
            }
        }
        open_->stream.pause();
        return "";
    }

    /// Makes the device render its own model after it is enabled. Returns "", or a sentence with the reason.
    [[nodiscard]] std::string choose_device_renderer() {
        const std::optional<wire::DeviceModel> model = open_->connection.model();
        if (!model) {
            return "does not report a model to render: build the header of 'palpate export --c' into its "
                   "firmware, or render on the host with a plan made without on_device";
        }
        if (options_.model) {
            if (std::string difference = wire::difference(*model, *options_.model); !difference.empty()) {
                return difference +
                       ": build the header that 'palpate export --c' writes for this plan into its firmware";
            }
        }
        const int code = open_->connection.request(wire::Request::Renderer,
                                                   static_cast<std::uint16_t>(wire::Renderer::Device));
        return code == LIBUSB_ERROR_PIPE
                   ? "refuses to render its model: the rate or the encoder differs from the certified one"
               : code != 0 ? "cannot render its model: " + detail::usb_reason(code)
                           : "";
    }

    /// Returns the fault that the status bits report as text, for example "an emergency stop".
    [[nodiscard]] static std::string fault_text(std::uint16_t bits) {
        return (bits & wire::emergency_stop) != 0     ? "an emergency stop"
               : (bits & wire::over_temperature) != 0 ? "over-temperature"
                                                      : "a fault of its encoder";
    }

    /// Reads the next valid packet. Returns false if no valid packet arrived before the deadline.
    [[nodiscard]] bool next_packet(Nanoseconds deadline) noexcept {
        detail::UsbArrival arrival;
        while (open_->transfers->wait_for_arrival(deadline)) {
            if (open_->transfers->take(arrival) && open_->stream.take(arrival.packet(), arrival.time)) {
                open_->arrived = arrival.time;
                return true;
            }
        }
        return false;
    }

    /// Discards the next `packets` packets. Returns false if fewer packets arrived before the deadline.
    [[nodiscard]] bool discard_packets(int packets, Nanoseconds deadline) noexcept {
        detail::UsbArrival old;
        for (int k = 0; k < packets; ++k) {
            if (!open_->transfers->wait_for_arrival(deadline)) {
                return false;
            }
            (void)open_->transfers->take(old);
        }
        return true;
    }

    /// Discards all waiting packets and returns true, if there are too many of them or if no packet was read after the
    /// last pause.
    [[nodiscard]] bool restarted() noexcept {
        if (open_->stream.follows() && open_->transfers->arrived() <= most_waiting_packets) {
            return false;
        }
        detail::UsbArrival old;
        while (open_->transfers->take(old)) {
            ++open_->discarded;
        }
        open_->stream.pause();
        open_->skipped_last = false;
        return true;
    }

    /// Sends the command for the last packet. The command is skipped if the previous command is still in flight, or if
    /// a newer packet has already arrived. Two consecutive commands are never both skipped for newer packets, and the
    /// command after an invalid reading is never skipped for one.
    void send_or_skip(double force, Nanoseconds deadline) noexcept {
        const bool ended = wait_for_last_write(deadline);
        const bool behind = !ended || (open_->reading_is_valid && open_->transfers->arrived() > 0);
        open_->skipped_last = behind && !open_->skipped_last;
        if (open_->skipped_last) {
            ++open_->skipped_commands;
            open_->sent_last = open_->sent_last && ended;
        } else {
            send(force);
        }
    }

    /// Waits until the last command has ended or a newer packet has arrived. Returns true if the command has ended. The
    /// end of a command and the packet that wakes the host come in the same USB frame (1 ms), in any order. A command
    /// that ends much later was sent in the next frame, close to a newer packet. Waiting for the newer packet prevents
    /// this command and all later commands from being one frame late.
    [[nodiscard]] bool wait_for_last_write(Nanoseconds deadline) noexcept {
        detail::UsbTransfers& transfers = *open_->transfers;
        if (!transfers.writes()) {
            return true;
        }
        (void)transfers.wait_for_write_or_arrival(deadline);
        const bool ended = !transfers.writes();
        const Nanoseconds now = monotonic_now();
        if (ended && now - open_->arrived > open_->frame / 2) {
            (void)transfers.wait_for_arrival(now + open_->frame / 4);
        }
        return ended;
    }

    /// Sends a force command, unless the previous command is still in flight.
    void send(double force) noexcept {
        const Nanoseconds now = monotonic_now();
        const wire::OutPacket packet = open_->stream.next_command(force, options_.time_to_live_ms, now);
        const int code = open_->transfers->write(packet);
        open_->sent_last = code == 0;
        if (open_->sent_last) {
            open_->stream.sent(packet, now);
        }
        open_->skipped_commands += code == LIBUSB_ERROR_BUSY ? 1 : 0;
    }

    /// Sends zero force and disables the device. If both fail, the device's watchdog ends the torque.
    [[nodiscard]] ZeroForce send_zero_and_disable() noexcept {
        detail::UsbTransfers& transfers = *open_->transfers;
        (void)transfers.wait_for_write(monotonic_now() + write_timeout);
        const std::uint64_t lost = transfers.lost_writes();
        send(0.0);
        (void)transfers.wait_for_write(monotonic_now() + write_timeout);
        const bool was_sent = open_->sent_last && transfers.lost_writes() == lost;
        return transfers.request(wire::Request::Enable, 0) == 0 ? ZeroForce::Confirmed
               : was_sent                                       ? ZeroForce::Sent
                                                                : ZeroForce::NotSent;
    }

    /// Sets the status of a reading to Lost if the last command was not sent or did not arrive, because the device then
    /// still applies an older force.
    [[nodiscard]] Reading with_loss_status(Reading reading) noexcept {
        const std::uint64_t lost = open_->transfers->lost_writes();
        const bool arrived = std::exchange(open_->lost_commands, lost) == lost && open_->sent_last;
        if (!arrived && sends_force(reading.status)) {
            reading.status = Status::Lost;
        }
        return reading;
    }

    /// Returns a copy of the last reading with the given status, for a failed tick; an empty reading if the device is
    /// closed. Only the position of the copy is valid.
    [[nodiscard]] Reading failed(Status status) const noexcept {
        Reading reading = open_ == nullptr ? Reading{} : open_->stream.reading();
        reading.status = status;
        return reading;
    }

    UsbOptions options_;
    std::unique_ptr<OpenDevice> open_;
    UsbName last_name_;
    wire::Info last_info_;
    UsbHealth last_health_;
};

static_assert(Device<UsbDevice>);

}  // namespace palpate
