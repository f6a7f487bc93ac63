// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <numbers>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

/// Packets between a USB device and its host, version 1: fixed size, little endian, without padding. A packet with
/// a wrong size, first byte or version is an error.
///
/// Signs: position = 2 pi count / counts_per_rev; a torque > 0 in a packet accelerates the handle towards larger
/// counts. A force in this library is the force of the object against the handle, so it is -1e-6 times the
/// packet's torque [N*m].
namespace palpate::wire {

inline constexpr std::uint16_t vendor_id = 0x1209;  ///< USB vendor number (idVendor)
inline constexpr std::uint16_t product_id =
    0x0001;  ///< USB product number (idProduct): test number of pid.codes, only for development
inline constexpr std::uint8_t interface_number = 0;  ///< number of the USB interface with both endpoints
inline constexpr std::array<std::uint8_t, 3> interface_kind{0xFF, 0x01, 0x01};  ///< class, subclass, protocol
inline constexpr std::uint8_t in_endpoint = 0x81;    ///< interrupt IN endpoint: packets from the device
inline constexpr std::uint8_t out_endpoint = 0x01;   ///< interrupt OUT endpoint: commands to the device
inline constexpr std::uint8_t protocol_version = 1;  ///< first field of every packet

inline constexpr std::uint8_t request_to_host = 0xC1;    ///< bmRequestType: vendor, interface
inline constexpr std::uint8_t request_to_device = 0x41;  ///< bmRequestType: vendor, interface
inline constexpr unsigned request_timeout_ms =
    500;  ///< longest time that a request waits for its answer [ms]

/// Numbers of the control requests to the device (the field bRequest of a control transfer).
enum class Request : std::uint8_t {
    GetInfo = 1,
    Enable = 2,
    Zero = 3,
    Watchdog = 4,
    Clear = 5,
    GetModel = 6,  ///< a device without a model, or with an older firmware, refuses this request
    Renderer = 7
};

/// Source of the device's torque; the value of the request `Renderer`.
enum class Renderer : std::uint8_t {
    Host = 0,   ///< the torque of each command
    Device = 1  ///< the model of the device; commands only keep it active
};

/// Returns a text with the cause and the cure of an error number of libusb; empty for an unknown number.
[[nodiscard]] constexpr std::string_view usb_cause(int code) noexcept {
    switch (code) {
        case -1:  // libusb returns this number as LIBUSB_ERROR_IO
            return "the transfer failed on the bus; try another cable or port";
        case -3:  // libusb returns this number as LIBUSB_ERROR_ACCESS
            return "permission denied; run 'sudo palpate devices --install-udev-rule' once, then plug the "
                   "device in again";
        case -4:  // libusb returns this number as LIBUSB_ERROR_NO_DEVICE
        case -5:  // libusb returns this number as LIBUSB_ERROR_NOT_FOUND
            return "the device was unplugged; plug it in and try again";
        case -6:  // libusb returns this number as LIBUSB_ERROR_BUSY
            return "another program uses the device; end that program, then try again";
        case -7:  // libusb returns this number as LIBUSB_ERROR_TIMEOUT
            return "the device does not answer; unplug it and plug it in again";
        case -9:  // libusb returns this number as LIBUSB_ERROR_PIPE
            return "the device refused a request; the version of its firmware may differ";
        case -11:  // libusb returns this number as LIBUSB_ERROR_NO_MEM
            return "the system has no memory left for USB; see "
                   "/sys/module/usbcore/parameters/usbfs_memory_mb";
        default:
            return "";
    }
}

// Bits of the status in a packet of the device (InPacket::status)
inline constexpr unsigned enabled = 1;  ///< status bit: the motor is enabled
inline constexpr unsigned watchdog_tripped =
    2;  ///< status bit: no command arrived in time, the torque is zero
inline constexpr unsigned torque_saturated =
    4;                                         ///< status bit: the torque was limited to the device's maximum
inline constexpr unsigned bad_packet = 8;      ///< status bit: the device refused a command packet
inline constexpr unsigned encoder_fault = 16;  ///< status bit: the encoder reported an error
inline constexpr unsigned over_temperature = 32;  ///< status bit: the motor or its driver is too hot
inline constexpr unsigned emergency_stop = 64;    ///< status bit: the emergency stop was pressed
/// Status bits that report a fault; after one of them the device and its packets are not reliable.
inline constexpr unsigned fault_bits = encoder_fault | over_temperature | emergency_stop;

// Bits that state which sensors the device has (Info::capabilities)
inline constexpr std::uint32_t has_transducer = 1;     ///< capability bit: the device measures torque
inline constexpr std::uint32_t measures_velocity = 2;  ///< capability bit: the device measures velocity

// The watchdog is the time for which the device makes force without a new command.
inline constexpr int shortest_watchdog_ms = 2;    ///< least setting of the watchdog [ms]
inline constexpr int longest_watchdog_ms = 1000;  ///< largest setting of the watchdog [ms]

/// Largest packet that USB full speed allows for an interrupt endpoint [bytes]
inline constexpr std::size_t largest_packet = 64;
inline constexpr std::size_t in_size = 32;     ///< size of an `InPacket` [bytes]
inline constexpr std::size_t out_size = 16;    ///< size of an `OutPacket` [bytes]
inline constexpr std::size_t info_size = 32;   ///< size of an `Info` [bytes]
inline constexpr std::size_t model_size = 24;  ///< size of a `DeviceModel` [bytes]

/// Packet that the device sends `Info::rate_hz` times a second.
struct InPacket {
    std::uint16_t sequence = 0;
    std::uint32_t clock_us = 0;      ///< time of the sample by the device's clock; 0 again after 71 minutes
    std::int32_t count = 0;          ///< encoder position [counts]
    std::int32_t velocity_cps = 0;   ///< velocity; 0 if not measured [counts/s]
    std::int32_t torque_uNm = 0;     ///< applied torque
    std::uint16_t status = 0;        ///< status bits
    std::uint16_t out_sequence = 0;  ///< number of the last command that the device accepted
    std::uint16_t out_age_us = 0;    ///< time since the last command was accepted, at most 65535 [us]
    std::uint16_t temperature_dC = 0;
    std::int32_t sensor_uNm = 0;  ///< measured torque; 0 without a transducer
};

/// Command packet to the device.
struct OutPacket {
    std::uint16_t sequence = 0;
    std::int32_t torque_uNm = 0;
    std::uint16_t time_to_live_ms = 10;  ///< the torque ends if no new command arrives for this time
    std::uint32_t host_us = 0;
};

/// Properties that a USB device reports about itself.
struct Info {
    std::uint16_t firmware = 0;
    std::uint32_t counts_per_rev = 0;
    std::int32_t max_torque_uNm = 0;
    std::uint16_t rate_hz = 0;
    std::uint16_t watchdog_ms = 0;
    std::uint32_t capabilities = 0;
    std::uint64_t uid = 0;
};

/// Model that a device can render itself.
struct DeviceModel {
    std::uint64_t fingerprint = 0;  ///< that of the exported model
    std::uint64_t certificate = 0;  ///< fingerprint of the certificate of its plan; 0 without a certificate
    std::uint32_t rate_hz = 0;      ///< certified rate of the device's control loop
    Renderer renderer = Renderer::Host;
};

namespace detail {

/// Reads integers from bytes, least byte first, one after the other.
class ByteReader {
  public:
    explicit ByteReader(std::span<const std::uint8_t> bytes) noexcept : bytes_{bytes} {}

    template <std::integral... Integer>
    void operator()(Integer&... values) noexcept {
        (take(values), ...);
    }

  private:
    template <std::integral Integer>
    void take(Integer& value) noexcept {
        std::uint64_t bits = 0;
        for (std::size_t k = 0; k < sizeof value; ++k) {
            bits |= static_cast<std::uint64_t>(bytes_[at_++]) << (8U * k);
        }
        value = static_cast<Integer>(bits);
    }

    std::span<const std::uint8_t> bytes_;
    std::size_t at_ = 0;
};

/// Writes integers to bytes, least byte first, one after the other.
class ByteWriter {
  public:
    explicit ByteWriter(std::span<std::uint8_t> bytes) noexcept : bytes_{bytes} {}

    template <std::integral... Integer>
    void operator()(Integer... values) noexcept {
        (put(values), ...);
    }

  private:
    template <std::integral Integer>
    void put(Integer value) noexcept {
        const auto bits = static_cast<std::uint64_t>(value);
        for (std::size_t k = 0; k < sizeof value; ++k) {
            bytes_[at_++] = static_cast<std::uint8_t>(bits >> (8U * k));
        }
    }

    std::span<std::uint8_t> bytes_;
    std::size_t at_ = 0;
};

}  // namespace detail

/// Reads a packet of the device from bytes. Returns false if the bytes are not a packet of this protocol.
[[nodiscard]] inline bool decode(std::span<const std::uint8_t> bytes, InPacket& packet) noexcept {
    if (bytes.size() != in_size || bytes[0] != 'H' || bytes[1] != protocol_version) {
        return false;
    }
    detail::ByteReader{bytes.subspan(2)}(packet.sequence, packet.clock_us, packet.count, packet.velocity_cps,
                                         packet.torque_uNm, packet.status, packet.out_sequence,
                                         packet.out_age_us, packet.temperature_dC, packet.sensor_uNm);
    return true;
}

/// Reads the answer to GET_INFO. Returns "", or a sentence with the invalid field, its value and the required
/// value.
[[nodiscard]] inline std::string decode(std::span<const std::uint8_t> bytes, Info& info) {
    using Number = std::int64_t;
    const std::string answer = "the answer to GET_INFO";
    if (bytes.size() != info_size) {
        return answer + " has " + std::to_string(bytes.size()) + " bytes, must have " +
               std::to_string(info_size);
    }
    if (bytes[0] != 'I') {
        constexpr const char* digits = "0123456789abcdef";
        return answer + " begins with 0x" + digits[bytes[0] >> 4U] + digits[bytes[0] & 15U] +
               ", must begin with 'I'";
    }
    std::uint8_t version = 0;
    std::uint8_t in_bytes = 0;
    std::uint8_t out_bytes = 0;
    std::uint8_t degrees_of_freedom = 0;
    std::uint8_t reserved = 0;
    detail::ByteReader{bytes.subspan(1)}(version, info.firmware, info.counts_per_rev, info.max_torque_uNm,
                                         info.rate_hz, info.watchdog_ms, info.capabilities, in_bytes,
                                         out_bytes, degrees_of_freedom, reserved, info.uid);
    const auto refusal = [&](const char* field, Number value, const std::string& required) {
        return answer + ": " + field + " is " + std::to_string(value) + ", must be " + required;
    };
    for (const auto& [field, value, required] :
         std::initializer_list<std::tuple<const char*, Number, Number>>{
             {"version", version, protocol_version},
             {"in_size", in_bytes, in_size},
             {"out_size", out_bytes, out_size},
             {"dof", degrees_of_freedom, 1},
             {"the reserved byte", reserved, 0},
             {"the value of undefined capability bits",
              info.capabilities & ~(has_transducer | measures_velocity), 0}}) {
        if (value != required) {
            return refusal(field, value, std::to_string(required));
        }
    }
    for (const auto& [field, value] :
         std::initializer_list<std::pair<const char*, Number>>{{"counts_per_rev", info.counts_per_rev},
                                                               {"max_torque_uNm", info.max_torque_uNm},
                                                               {"rate_hz", info.rate_hz},
                                                               {"watchdog_ms", info.watchdog_ms}}) {
        if (value <= 0) {
            return refusal(field, value, "> 0");
        }
    }
    return "";
}

/// Reads the answer to GET_MODEL. Returns "", or a sentence with the invalid field, its value and the required value.
[[nodiscard]] inline std::string decode(std::span<const std::uint8_t> bytes, DeviceModel& model) {
    const std::string answer = "the answer to GET_MODEL";
    if (bytes.size() != model_size) {
        return answer + " has " + std::to_string(bytes.size()) + " bytes, must have " +
               std::to_string(model_size);
    }
    std::uint32_t renderer = 0;  // one byte, and three reserved bytes that must be 0
    detail::ByteReader{bytes}(model.fingerprint, model.certificate, model.rate_hz, renderer);
    if (model.rate_hz == 0) {
        return answer + ": rate_hz is 0, must be > 0";
    }
    if (renderer > static_cast<std::uint32_t>(Renderer::Device)) {
        return answer + ": renderer is " + std::to_string(renderer) + ", must be 0 or 1";
    }
    model.renderer = static_cast<Renderer>(renderer);
    return "";
}

/// Returns a fingerprint as 16 hexadecimal digits.
[[nodiscard]] inline std::string fingerprint_text(std::uint64_t fingerprint) {
    constexpr const char* digits = "0123456789abcdef";
    std::string text;
    for (unsigned shift = 64; shift > 0; shift -= 4) {
        text += digits[fingerprint >> (shift - 4) & 15U];
    }
    return text;
}

/// Returns the difference between the model of a device and the planned model as a part of a sentence; empty if the
/// device contains the planned model with the same certificate and rate.
[[nodiscard]] inline std::string difference(const DeviceModel& model, const DeviceModel& planned) {
    if (model.fingerprint != planned.fingerprint) {
        return "contains the model " + fingerprint_text(model.fingerprint) +
               ", but the plan is for the model " + fingerprint_text(planned.fingerprint);
    }
    if (model.certificate != planned.certificate) {
        return "contains this model with the certificate " + fingerprint_text(model.certificate) +
               ", but that of the plan is " + fingerprint_text(planned.certificate);
    }
    if (model.rate_hz != planned.rate_hz) {
        return "renders this model at " + std::to_string(model.rate_hz) +
               " Hz, but the certificate of the plan is for " + std::to_string(planned.rate_hz) + " Hz";
    }
    return "";
}

/// Returns the bytes of a command packet.
[[nodiscard]] inline std::array<std::uint8_t, out_size> encode(const OutPacket& packet) noexcept {
    constexpr std::uint16_t flags = 0;
    std::array<std::uint8_t, out_size> bytes{};
    detail::ByteWriter{bytes}(std::uint8_t{'T'}, protocol_version, packet.sequence, packet.torque_uNm, flags,
                              packet.time_to_live_ms, packet.host_us);
    return bytes;
}

/// Converts an encoder count to a position [rad].
[[nodiscard]] inline double position_of(std::int64_t count, std::uint32_t counts_per_rev) noexcept {
    return 2.0 * std::numbers::pi * static_cast<double>(count) / static_cast<double>(counts_per_rev);
}

/// Converts the torque of a packet to the force of the object against the handle [N*m].
[[nodiscard]] inline double force_of(std::int32_t torque_uNm) noexcept {
    return 0.0 - 1e-6 * static_cast<double>(torque_uNm);
}

/// Converts a force of the object to the torque of a packet, limited to the device's largest torque; 0 for NaN.
[[nodiscard]] inline std::int32_t torque_of(double force, std::int32_t max_torque_uNm) noexcept {
    if (std::isnan(force)) {
        return 0;
    }
    const auto largest = static_cast<double>(max_torque_uNm);
    return static_cast<std::int32_t>(std::lround(std::clamp(-1e6 * force, -largest, largest)));
}

/// Extends a counter that restarts at 0 after its largest value to a 64-bit counter that does not restart. A step of
/// half the counter's range or more counts as a negative step.
template <std::integral Counter>
class Unwrapped {
  public:
    /// Adds a reading of the counter. Returns its increase since the previous reading; 0 for the first reading.
    std::int64_t follow(Counter reading) noexcept {
        using Unsigned = std::make_unsigned_t<Counter>;
        const auto ahead =
            static_cast<Unsigned>(static_cast<Unsigned>(reading) - static_cast<Unsigned>(last_));
        const auto step = started_ ? static_cast<std::make_signed_t<Counter>>(ahead) : 0;
        value_ = started_ ? value_ + step : static_cast<std::int64_t>(reading);
        last_ = reading;
        started_ = true;
        return step;
    }

    [[nodiscard]] std::int64_t value() const noexcept { return value_; }
    [[nodiscard]] bool started() const noexcept { return started_; }

  private:
    bool started_ = false;
    Counter last_ = 0;
    std::int64_t value_ = 0;
};

}  // namespace palpate::wire
