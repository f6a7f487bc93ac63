// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <utility>

#include "firmware.hpp"
#include "identity.hpp"
#include "motor.hpp"

namespace emulator {

/// Second implementation of the device side, in C++. It shares no code with the first one in cpp/firmware.
class MotorFirmware : public Firmware {
  public:
    explicit MotorFirmware(Identity identity) : identity_{std::move(identity)}, motor_{identity_} {}

    void restart() override {
        motor_ = Motor{identity_};
        sample_ = {};
        zero_ = 0;
        sequence_ = 0;
    }
    void tick(const Sample& sample) override {
        sample_ = sample;
        motor_.tick(sample.clock_us, count());
    }
    void out(const Bytes& packet, std::uint32_t clock_us) override { motor_.take(packet, clock_us); }
    [[nodiscard]] Bytes in() override {
        Bytes packet{'H', 1};
        put(packet, ++sequence_);
        put(packet, sample_.clock_us);
        put(packet, count());
        put(packet, sample_.velocity_cps);
        put(packet, motor_.torque_uNm());
        put(packet, motor_.status());
        put(packet, motor_.out_sequence());
        put(packet, motor_.out_age_us(sample_.clock_us));
        put(packet, sample_.temperature_dC);
        put(packet, sample_.sensor_uNm);
        return packet;
    }
    [[nodiscard]] Answer control(const Bytes& bytes) override {
        const Setup setup{bytes};
        Answer answer = stalled();
        if (setup.type == 0xC1) {
            answer = read(setup.request);
        } else if (setup.type == 0x41 && setup.length == 0) {
            answer = command(setup.request, setup.value);
        }
        if (answer.data.size() > setup.length) {
            answer.data.resize(setup.length);
        }
        return answer;
    }
    void disarm() override { motor_.disarm(); }
    void fault(std::uint16_t present) override { motor_.set_faults(present); }
    [[nodiscard]] FirmwareState state() const override {
        return {motor_.torque_uNm(), motor_.status(), motor_.out_sequence()};
    }

  private:
    [[nodiscard]] std::int32_t count() const {
        return static_cast<std::int32_t>(static_cast<std::int64_t>(sample_.count) - zero_);
    }
    [[nodiscard]] Answer read(std::uint8_t request) const {
        Bytes bytes;
        if (request == 1) {  // GET_INFO
            bytes = {'I', 1};
            put(bytes, identity_.firmware);
            put(bytes, identity_.counts_per_rev);
            put(bytes, identity_.max_torque_uNm);
            put(bytes, identity_.rate_hz);
            put(bytes, motor_.watchdog_ms());
            put(bytes, identity_.capabilities);
            bytes.insert(bytes.end(), {32, 16, 1, 0});
            put(bytes, identity_.uid);
        } else if (request == 6 && identity_.model_uNm_per_count != 0) {  // GET_MODEL
            put(bytes, identity_.model_fingerprint);
            put(bytes, identity_.model_certificate);
            put(bytes, identity_.loop_hz);
            bytes.insert(bytes.end(), {static_cast<std::uint8_t>(motor_.renders_itself()), 0, 0, 0});
        }
        return bytes.empty() ? stalled() : Answer{0, bytes};
    }
    Answer command(std::uint8_t request, std::uint16_t value) {
        switch (request) {
            case 2:
                return motor_.enable(value);
            case 3:  // ZERO
                zero_ = sample_.count;
                motor_.shift_position();
                return {};
            case 4:
                return motor_.set_watchdog(value);
            case 5:
                return motor_.clear();
            case 7:
                return motor_.render(value);
            default:
                return stalled();
        }
    }

    Identity identity_;
    Motor motor_;
    Sample sample_;
    std::int32_t zero_ = 0;
    std::uint16_t sequence_ = 0;
};

}  // namespace emulator
