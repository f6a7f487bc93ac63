// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <utility>

#include "firmware.hpp"
#include "identity.hpp"
#include "palpate_device.h"

namespace emulator {

/// Device side in C99 (cpp/firmware), compiled for this computer.
class CFirmware : public Firmware {
  public:
    explicit CFirmware(Identity identity)
        : identity_{std::move(identity)},
          properties_{
              identity_.uid,     identity_.counts_per_rev, identity_.capabilities, identity_.max_torque_uNm,
              identity_.loop_hz, identity_.rate_hz,        identity_.watchdog_ms,  identity_.ramp_ms,
              identity_.firmware},
          model_{identity_.model_fingerprint,
                 identity_.model_certificate,
                 identity_.loop_hz,
                 identity_.counts_per_rev,
                 [](void*, std::int32_t) {},
                 [](void* state, std::int32_t count) {
                     return static_cast<const Identity*>(state)->model_torque_uNm(count);
                 },
                 &identity_} {
        CFirmware::restart();
    }

    void restart() override {
        palpate_device_start(&device_, &properties_, identity_.model_uNm_per_count == 0 ? nullptr : &model_);
    }
    void tick(const Sample& sample) override {
        const palpate_sample read{sample.clock_us, sample.count, sample.velocity_cps, sample.sensor_uNm,
                                  sample.temperature_dC};
        palpate_device_tick(&device_, &read);
    }
    void out(const Bytes& packet, std::uint32_t clock_us) override {
        palpate_device_out(&device_, packet.data(), packet.size(), clock_us);
    }
    [[nodiscard]] Bytes in() override {
        Bytes packet(PALPATE_IN_SIZE);
        palpate_device_in(&device_, packet.data());
        return packet;
    }
    [[nodiscard]] Answer control(const Bytes& setup) override {
        std::array<std::uint8_t, PALPATE_ANSWER_SIZE> bytes{};
        const int size = palpate_device_control(&device_, setup.data(), bytes.data());
        return size < 0 ? stalled() : Answer{0, {bytes.begin(), bytes.begin() + size}};
    }
    void disarm() override { palpate_device_disarm(&device_); }
    void fault(std::uint16_t present) override { palpate_device_fault(&device_, present); }
    [[nodiscard]] FirmwareState state() const override {
        return {device_.torque_uNm, device_.status, device_.out_sequence};
    }
    [[nodiscard]] const palpate_device& device() const { return device_; }

  private:
    Identity identity_;
    palpate_properties properties_;
    palpate_model model_;
    palpate_device device_{};
};

}  // namespace emulator
