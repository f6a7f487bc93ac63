// SPDX-License-Identifier: Apache-2.0
// The device side in C99, under any sequence of ticks, commands, control requests, faults and bus resets. The torque is
// never above the largest torque of the device, and zero while disabled, during a fault, after the watchdog, and after
// every event that sets zero torque until the next command. Packets and answers are valid for the host.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "fuzzing.hpp"
#include "palpate/device/wire.hpp"
#include "palpate_device.h"

namespace palpate::fuzz {
namespace {

/// Torque that the model of the device returns next.
struct Model {
    std::int32_t torque_uNm = 0;
    bool started = false;
};

palpate_properties properties_of(Input& input) {
    palpate_properties is{};
    is.uid = 7;
    is.counts_per_rev = 65536;
    is.capabilities = input.take<std::uint8_t>() % 4;
    is.max_torque_uNm = std::max<std::int32_t>(1, input.take<std::int32_t>() & INT32_MAX);
    is.loop_hz = 10'000;
    is.rate_hz = 1000;
    is.watchdog_ms = static_cast<std::uint16_t>(std::clamp<int>(input.take<std::uint16_t>(), 2, 1000));
    is.ramp_ms = static_cast<std::uint16_t>(std::min<int>(input.take<std::uint16_t>(), 10'000));
    is.firmware = 0x0100;
    return is;
}

/// A device with its inputs. The clock of the device is the lower half of `time_us`.
class Device {
  public:
    explicit Device(Input& input) : properties_{properties_of(input)}, time_us_{input.take<std::uint32_t>()} {
        const bool has_model = input.take<std::uint8_t>() % 4 != 0;
        palpate_device_start(&device_, &properties_, has_model ? &palpate_model_ : nullptr);
    }

    void apply(Input& input) {
        switch (input.take<std::uint8_t>() % 8) {
            case 0:
                return tick(input, input.take<std::uint16_t>());
            case 1:  // a long time without ticks, at most 17 minutes: the clock may overflow, but an age of it may not
                return tick(input, input.take<std::uint32_t>() >> 2U);
            case 2:
                return command(input);
            case 3:
                return any_packet(input);
            case 4:
                return request(input,
                               std::array<std::uint8_t, 5>{2, 3, 4, 5, 7}.at(input.take<std::uint8_t>() % 5));
            case 5:
                return request(input, input.take<std::uint8_t>());
            case 6:
                palpate_device_disarm(&device_);
                expect_zero(true);
                return;
            default:
                return fault(input.take<std::uint16_t>());
        }
    }

    void check() {
        const std::int32_t torque = device_.torque_uNm;
        require(std::abs(std::int64_t{torque}) <= properties_.max_torque_uNm, "the torque is limited");
        require(torque == 0 || (device_.status & (PALPATE_ENABLED | PALPATE_FAULTS | PALPATE_WATCHDOG)) ==
                                   PALPATE_ENABLED,
                "torque needs an enabled device without fault and watchdog");
        require(torque == 0 || !zero_until_command_, "the torque is zero until the next command");
        require(torque == 0 || !zero_until_enable_, "the torque is zero until the motor is enabled");
        check_packet();
    }

  private:
    [[nodiscard]] std::uint32_t clock_us() const { return static_cast<std::uint32_t>(time_us_); }

    void expect_zero(bool disabled) {
        zero_until_command_ = true;
        zero_until_enable_ = zero_until_enable_ || disabled;
        require(device_.torque_uNm == 0, "the event sets zero torque");
    }

    void tick(Input& input, std::uint32_t passed_us) {
        time_us_ += passed_us;
        model_.torque_uNm = input.take<std::int32_t>();
        const palpate_sample sample{clock_us(), input.take<std::int32_t>(), input.take<std::int32_t>(),
                                    input.take<std::int32_t>(), 250};
        const std::int32_t torque = palpate_device_tick(&device_, &sample);
        require(torque == device_.torque_uNm, "a tick returns the torque of the motor");
        const std::uint64_t life_us = 1000 * std::uint64_t{std::min(life_ms_, watchdog_ms_)};
        require(torque == 0 || time_us_ - command_us_ < life_us, "the watchdog sets zero torque");
    }

    void command(Input& input) {
        std::array<std::uint8_t, PALPATE_OUT_SIZE> bytes{};
        const wire::OutPacket packet{input.take<std::uint16_t>(), input.take<std::int32_t>(),
                                     input.take<std::uint16_t>(), 0};
        bytes = wire::encode(packet);
        time_us_ += input.take<std::uint8_t>();
        palpate_device_out(&device_, bytes.data(), bytes.size(), clock_us());
        require((device_.status & PALPATE_BAD_PACKET) == 0, "a command of the host is valid");
        accepted(packet.time_to_live_ms);
    }

    void any_packet(Input& input) {
        const auto given = input.take_bytes(input.take<std::uint8_t>() % 65);
        const std::vector<std::uint8_t> bytes{given.begin(),
                                              given.end()};  // exact size: a longer read is an error
        palpate_device_out(&device_, bytes.data(), bytes.size(), clock_us());
        if ((device_.status & PALPATE_BAD_PACKET) == 0) {
            require(bytes.size() == PALPATE_OUT_SIZE, "a command has 16 bytes");
            accepted(static_cast<std::uint16_t>(bytes[10] | bytes[11] << 8U));
        }
    }

    void accepted(std::uint16_t life_ms) {
        command_us_ = time_us_;
        life_ms_ = life_ms;
        zero_until_command_ = false;
    }

    void request(Input& input, std::uint8_t number) {
        std::array<std::uint8_t, PALPATE_SETUP_SIZE> setup{};
        setup[0] = number == 1 || number == 6 ? wire::request_to_host : wire::request_to_device;
        setup[1] = number;
        const auto value = input.take<std::uint16_t>();
        setup[2] = static_cast<std::uint8_t>(value);
        setup[3] = static_cast<std::uint8_t>(value >> 8U);
        setup[6] = number == 1 || number == 6 ? input.take<std::uint8_t>() : std::uint8_t{0};
        if (input.take<std::uint8_t>() == 0) {
            setup[0] = input.take<std::uint8_t>();
        }
        std::array<std::uint8_t, PALPATE_ANSWER_SIZE> answer{};
        const int size = palpate_device_control(&device_, setup.data(), answer.data());
        require(size >= PALPATE_STALL && size <= setup[6], "an answer is not longer than requested");
        if (size > 0) {
            check_answer(number, {answer.data(), static_cast<std::size_t>(size)});
        }
        if (setup[0] != wire::request_to_device || size == PALPATE_STALL) {
            return;
        }
        switch (number) {
            case 2:
                zero_until_enable_ = false;
                return expect_zero(value == 0);
            case 4:
                watchdog_ms_ = value;
                require(value >= wire::shortest_watchdog_ms && value <= wire::longest_watchdog_ms,
                        "the watchdog time is within its range");
                return;
            case 5:
            case 7:
                return expect_zero(false);
            default:
                return;
        }
    }

    void check_answer(std::uint8_t number, std::span<const std::uint8_t> bytes) {
        wire::Info info;
        require(number != 1 || bytes.size() < wire::info_size || wire::decode(bytes, info).empty(),
                "the host accepts the properties of the device");
        wire::DeviceModel model;
        require(number != 6 || bytes.size() < wire::model_size || wire::decode(bytes, model).empty(),
                "the host accepts the model of the device");
    }

    void fault(std::uint16_t present) {
        palpate_device_fault(&device_, present);
        if ((present & PALPATE_FAULTS) != 0) {
            expect_zero((present & PALPATE_EMERGENCY_STOP) != 0);
        }
    }

    void check_packet() {
        std::array<std::uint8_t, PALPATE_IN_SIZE> bytes{};
        palpate_device_in(&device_, bytes.data());
        wire::InPacket packet;
        require(wire::decode(bytes, packet), "the host accepts a packet of the device");
        require(packet.torque_uNm == device_.torque_uNm && packet.status == device_.status,
                "a packet states torque and status");
    }

    palpate_properties properties_;
    Model model_;
    palpate_model palpate_model_{
        1,
        2,
        10'000,
        65536,
        [](void* state, std::int32_t) { static_cast<Model*>(state)->started = true; },
        [](void* state, std::int32_t) {
            require(static_cast<Model*>(state)->started, "a model starts before its first tick");
            return static_cast<Model*>(state)->torque_uNm;
        },
        &model_};
    palpate_device device_{};
    std::uint64_t time_us_;
    std::uint64_t command_us_ = 0;
    std::uint16_t life_ms_ = 0;
    std::uint16_t watchdog_ms_ = properties_.watchdog_ms;
    bool zero_until_command_ = true;
    bool zero_until_enable_ = true;
};

}  // namespace
}  // namespace palpate::fuzz

FUZZ_TARGET(firmware) {
    palpate::fuzz::Input input{data, size};
    palpate::fuzz::Device device{input};
    while (!input.empty()) {
        device.apply(input);
        device.check();
    }
    return 0;
}
