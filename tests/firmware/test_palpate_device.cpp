// SPDX-License-Identifier: Apache-2.0
// Tests the device side in C99: its packets against the host's decoder, the model on the device, faults, threads.
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "../cpp/support.hpp"
#include "firmware_pair.hpp"
#include "locks.hpp"
#include "palpate/device/wire.hpp"

namespace palpate::test {
namespace {

/// A model on the device that counts its calls and checks that the device is not locked.
struct CountingModel {
    int starts = 0;
    int steps = 0;
    std::int32_t last_count = 0;
    std::int32_t torque_uNm = 4'096;
    std::function<void()> during_step = [] {};

    [[nodiscard]] palpate_model model() {
        return {0xFEDC'BA98'7654'3210U, 0x0F1E'2D3C'4B5A'6978U, 10'000, 65'536,
                &CountingModel::start,  &CountingModel::step,   this};
    }
    static void start(void* state, std::int32_t count) {
        auto& self = *static_cast<CountingModel*>(state);
        ++self.starts;
        self.last_count = count;
        EXPECT_EQ(lock_depth(), 0);
    }
    static std::int32_t step(void* state, std::int32_t count) {
        auto& self = *static_cast<CountingModel*>(state);
        ++self.steps;
        self.last_count = count;
        EXPECT_EQ(lock_depth(), 0);
        self.during_step();
        return self.torque_uNm;
    }
};

/// A device with a counting model and a ramp of 2 ms.
struct Rig {
    CountingModel counting;
    palpate_model model = counting.model();
    palpate_properties properties{7, 65'536, 3, most_uNm, 10'000, 1'000, 20, 2, 0x0203};
    palpate_device device{};
    std::uint32_t clock_us = 0;

    Rig() { palpate_device_start(&device, &properties, &model); }

    std::int32_t tick(std::int32_t count = 0, std::uint32_t passed_us = 100) {
        clock_us += passed_us;
        const palpate_sample sample{clock_us, count, -5, 6, 253};
        return palpate_device_tick(&device, &sample);
    }
    int control(std::uint8_t request, std::uint16_t value) {
        std::uint8_t answer[PALPATE_ANSWER_SIZE];
        return palpate_device_control(&device, setup(0x41, request, value).data(), answer);
    }
    void out(std::int32_t torque_uNm, std::uint16_t sequence = 1, std::uint16_t life_ms = 10) {
        const Bytes packet = command(sequence, torque_uNm, life_ms);
        palpate_device_out(&device, packet.data(), packet.size(), clock_us);
    }
    void render_model() {
        EXPECT_EQ(control(7, 1), 0);
        EXPECT_EQ(control(2, 1), 0);
        out(0);
    }
};

TEST(PalpateDevice, FitsIntoTheRequiredMemory) {
    if (sizeof(void*) == 4) {
        EXPECT_LE(sizeof(palpate_device), 64U);
    }
    EXPECT_LE(sizeof(palpate_device), 80U);
}

TEST(PalpateDevice, HostDecodesItsPackets) {
    Rig rig;
    rig.control(2, 1);
    rig.tick(-1'000);
    rig.control(3, 0);  // ZERO
    const auto bytes = wire::encode({.sequence = 0x1234, .torque_uNm = -700'000, .time_to_live_ms = 9});
    palpate_device_out(&rig.device, bytes.data(), bytes.size(), rig.clock_us);
    EXPECT_EQ(rig.tick(-1'700, 150), -most_uNm);
    std::uint8_t sent[PALPATE_IN_SIZE];
    palpate_device_in(&rig.device, sent);
    wire::InPacket packet;
    ASSERT_TRUE(wire::decode(sent, packet));
    EXPECT_EQ(packet.sequence, 1);
    EXPECT_EQ(packet.clock_us, 250U);
    EXPECT_EQ(packet.count, -700);
    EXPECT_EQ(packet.velocity_cps, -5);
    EXPECT_EQ(packet.torque_uNm, -most_uNm);
    EXPECT_EQ(packet.status, wire::enabled | wire::torque_saturated);
    EXPECT_EQ(packet.out_sequence, 0x1234);
    EXPECT_EQ(packet.out_age_us, 150);
    EXPECT_EQ(packet.temperature_dC, 253);
    EXPECT_EQ(packet.sensor_uNm, 6);
}

TEST(PalpateDevice, HostDecodesItsInfoAndItsModel) {
    Rig rig;
    std::uint8_t answer[PALPATE_ANSWER_SIZE];
    wire::Info info;
    ASSERT_EQ(palpate_device_control(&rig.device, setup(0xC1, 1, 0, 64).data(), answer), 32);
    ASSERT_EQ(wire::decode(answer, info), "");
    EXPECT_EQ(info.firmware, 0x0203);
    EXPECT_EQ(info.counts_per_rev, 65'536U);
    EXPECT_EQ(info.max_torque_uNm, most_uNm);
    EXPECT_EQ(info.rate_hz, 1'000);
    EXPECT_EQ(info.watchdog_ms, 20);
    EXPECT_EQ(info.capabilities, 3U);
    EXPECT_EQ(info.uid, 7U);
    wire::DeviceModel model;
    EXPECT_EQ(rig.control(7, 1), 0);
    ASSERT_EQ(palpate_device_control(&rig.device, setup(0xC1, 6, 0, 64).data(), answer), 24);
    ASSERT_EQ(wire::decode(std::span{answer}.first(24), model), "");
    EXPECT_EQ(model.fingerprint, 0xFEDC'BA98'7654'3210U);
    EXPECT_EQ(model.certificate, 0x0F1E'2D3C'4B5A'6978U);
    EXPECT_EQ(model.rate_hz, 10'000U);
    EXPECT_EQ(model.renderer, wire::Renderer::Device);
}

TEST(PalpateDevice, RefusesAModelOfAnotherRateOrEncoderAndADeviceWithoutOne) {
    for (int kind = 0; kind < 3; ++kind) {
        Rig rig;
        rig.model.rate_hz += kind == 0 ? 1 : 0;
        rig.model.counts_per_rev += kind == 1 ? 1 : 0;
        palpate_device_start(&rig.device, &rig.properties, kind == 2 ? nullptr : &rig.model);
        EXPECT_EQ(rig.control(7, 1), PALPATE_STALL) << kind;
        EXPECT_EQ(rig.control(7, 0), 0) << kind;
        rig.control(2, 1);
        rig.out(1'000);
        EXPECT_EQ(rig.tick(), 1'000) << "the host renders";
    }
}

TEST(PalpateDevice, TheForceOfItsModelGrowsFromZero) {
    Rig rig;
    rig.render_model();
    std::int32_t last = 0;
    for (int k = 0; k <= 20; ++k) {
        const std::int32_t torque = rig.tick();
        EXPECT_NEAR(torque, 4'096 * k / 20, 4'096 / 60) << k;
        EXPECT_GE(torque, last);
        last = torque;
    }
    EXPECT_EQ(last, 4'096);
    rig.counting.torque_uNm = INT32_MIN;
    rig.out(0);
    EXPECT_EQ(rig.tick(), -most_uNm);
    EXPECT_TRUE(rig.device.status & PALPATE_SATURATED);
}

TEST(PalpateDevice, ItsModelRendersOnlyWhileTheHostSendsCommands) {
    Rig rig;
    EXPECT_EQ(rig.control(7, 1), 0);
    EXPECT_EQ(rig.control(2, 1), 0);
    rig.tick();
    EXPECT_EQ(rig.counting.steps, 0) << "no command has arrived";
    rig.out(999'999);  // the torque of a command has no effect
    for (int k = 0; k < 99; ++k) {
        rig.tick();
    }
    EXPECT_EQ(rig.device.torque_uNm, 4'096);
    EXPECT_FALSE(rig.device.status & PALPATE_SATURATED);
    EXPECT_EQ(rig.tick(), 0) << "10 ms after the command";
    EXPECT_TRUE(rig.device.status & PALPATE_WATCHDOG);
}

TEST(PalpateDevice, ItsModelStartsAgainAfterEveryInterruption) {
    const std::vector<std::function<void(Rig&)>> interruptions{[](Rig& rig) { rig.tick(0, 30'000); },
                                                               [](Rig& rig) { rig.control(2, 1); },
                                                               [](Rig& rig) { rig.control(3, 0); },
                                                               [](Rig& rig) { rig.control(7, 1); },
                                                               [](Rig& rig) { rig.control(5, 0); },
                                                               [](Rig& rig) {
                                                                   palpate_device_disarm(&rig.device);
                                                                   rig.control(7, 1);
                                                                   rig.control(2, 1);
                                                               },
                                                               [](Rig& rig) {
                                                                   palpate_device_fault(
                                                                       &rig.device, PALPATE_ENCODER_FAULT);
                                                                   palpate_device_fault(&rig.device, 0);
                                                                   rig.control(5, 0);
                                                               }};
    for (std::size_t k = 0; k < interruptions.size(); ++k) {
        Rig rig;
        rig.render_model();
        for (int tick = 0; tick < 50; ++tick) {
            rig.tick(500);
        }
        EXPECT_EQ(rig.counting.starts, 1) << k;
        EXPECT_EQ(rig.device.torque_uNm, 4'096) << k;
        interruptions[k](rig);
        rig.tick(700);
        rig.out(0);
        EXPECT_EQ(rig.tick(700), 0) << "the ramp starts again: " << k;
        EXPECT_EQ(rig.counting.starts, 2) << k;
        EXPECT_EQ(rig.counting.last_count, k == 2 ? 200 : 700) << k;
    }
}

// The control interrupt computes the model without a lock, so a USB interrupt can come in between.
TEST(PalpateDevice, AnEventWhileTheModelIsComputedSetsZeroTorque) {
    Rig rig;
    const std::vector<std::function<void()>> events{
        [&] { palpate_device_disarm(&rig.device); },
        [&] { palpate_device_fault(&rig.device, PALPATE_OVER_TEMPERATURE); }, [&] { rig.control(2, 0); },
        [&] {  // another host takes the device over
            rig.control(2, 0);
            rig.control(2, 1);
            rig.out(123);
        }};
    for (std::size_t k = 0; k < events.size(); ++k) {
        rig.control(5, 0);
        rig.render_model();
        rig.counting.during_step = [] {};
        for (int tick = 0; tick < 50; ++tick) {
            rig.tick();
        }
        ASSERT_EQ(rig.device.torque_uNm, 4'096) << k;
        rig.counting.during_step = events[k];
        EXPECT_EQ(rig.tick(), 0) << k;
        palpate_device_fault(&rig.device, 0);
    }
}

TEST(PalpateDevice, AnEmergencyStopCannotBeClearedWhileItIsPressed) {
    Rig rig;
    rig.control(2, 1);
    palpate_device_fault(&rig.device, PALPATE_EMERGENCY_STOP);
    rig.control(5, 0);
    EXPECT_EQ(rig.control(2, 1), PALPATE_STALL);
    palpate_device_fault(&rig.device, 0);
    EXPECT_EQ(rig.control(2, 1), PALPATE_STALL) << "not cleared";
    rig.control(5, 0);
    EXPECT_EQ(rig.control(2, 1), 0);
}

TEST(PalpateDevice, ACommandDuringAFaultHasNoEffectAfterClear) {
    Rig rig;
    rig.control(2, 1);
    palpate_device_fault(&rig.device, PALPATE_ENCODER_FAULT);
    rig.out(2'000);
    EXPECT_EQ(rig.tick(), 0);
    palpate_device_fault(&rig.device, 0);
    rig.control(5, 0);
    EXPECT_EQ(rig.tick(), 0);
    rig.out(2'000);
    EXPECT_EQ(rig.tick(), 2'000);
}

// The USB interrupt can come after the tick has read the clock.
TEST(PalpateDevice, ACommandNewerThanTheTickIsNotOld) {
    Rig rig;
    rig.control(2, 1);
    const Bytes packet = command(1, 2'000);
    palpate_device_out(&rig.device, packet.data(), packet.size(), 105);
    EXPECT_EQ(rig.tick(0, 100), 2'000);
    std::uint8_t sent[PALPATE_IN_SIZE];
    palpate_device_in(&rig.device, sent);
    EXPECT_EQ(emulator::get<std::uint16_t>({sent, sent + sizeof sent}, 24), 0);
}

TEST(PalpateDevice, AnOldCommandStaysOldWhenTheClockReturnsToZero) {
    for (const int watchdog_ms : {20, 1'000}) {
        Rig rig;
        rig.control(4, static_cast<std::uint16_t>(watchdog_ms));
        rig.control(2, 1);
        rig.out(2'000, 1, 0xFFFF);
        for (int second = 0; second < 3 * 3'600; ++second) {  // the clock wraps twice
            EXPECT_EQ(rig.tick(0, 1'000'000), 0);
            std::uint8_t sent[PALPATE_IN_SIZE];
            palpate_device_in(&rig.device, sent);
            ASSERT_EQ(emulator::get<std::uint16_t>({sent, sent + sizeof sent}, 24), 0xFFFF) << second;
            ASSERT_TRUE(rig.device.status & PALPATE_WATCHDOG) << second;
        }
    }
}

TEST(PalpateDevice, TheRampDoesNotReturnAfterHours) {
    Rig rig;
    rig.control(4, 1'000);  // WATCHDOG
    rig.render_model();
    for (int k = 0; k < 10'000; ++k) {  // 2.5 hours
        rig.out(0, 1, 1'000);
        rig.tick(0, 900'000);
        ASSERT_TRUE(k == 0 || rig.device.torque_uNm == 4'096) << k;
    }
}

// Threads take the place of interrupts; the thread sanitizer runs this test.
TEST(PalpateDevice, InterruptsMayCallItAtAnyTime) {
    Rig rig;
    std::atomic<bool> over{false};
    std::thread control{[&] {
        while (!over) {
            EXPECT_LE(std::abs(rig.tick(300)), most_uNm);
        }
    }};
    std::thread emergency{[&] {
        for (int k = 0; k < cases(2'000); ++k) {
            palpate_device_fault(&rig.device, k % 10 == 0 ? PALPATE_EMERGENCY_STOP : 0);
            palpate_device_disarm(&rig.device);
        }
    }};
    const Bytes packet = command(1, 2'000);
    std::uint8_t sent[PALPATE_IN_SIZE];
    for (int k = 0; k < cases(2'000); ++k) {
        rig.control(5, 0);
        rig.control(7, static_cast<std::uint16_t>(k % 2));
        rig.control(2, 1);
        palpate_device_out(&rig.device, packet.data(), packet.size(), static_cast<std::uint32_t>(k));
        palpate_device_in(&rig.device, sent);
    }
    emergency.join();
    over = true;
    control.join();
    palpate_device_disarm(&rig.device);
    EXPECT_EQ(rig.tick(), 0);
    EXPECT_EQ(lock_depth(), 0);
}

}  // namespace
}  // namespace palpate::test
