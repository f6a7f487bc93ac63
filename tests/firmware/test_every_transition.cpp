// SPDX-License-Identifier: Apache-2.0
// Applies every event to every reachable state of the device side, and compares both implementations on random
// sequences of events.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <random>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "../cpp/support.hpp"
#include "firmware_pair.hpp"

namespace palpate::test {
namespace {

/// An event, and its required effect on the torque.
struct Event {
    std::string name;
    std::function<void(FirmwarePair&)> apply;
    bool sets_zero_torque = false;  ///< in every state; the torque stays zero until the next command
    bool is_command = false;
};

constexpr std::uint8_t to_device = 0x41;
constexpr std::uint8_t to_host = 0xC1;

Event request(const std::string& name, std::uint8_t number, std::uint16_t value,
              bool sets_zero_torque = false) {
    return {name, [=](FirmwarePair& pair) { pair.control(setup(to_device, number, value)); },
            sets_zero_torque};
}

Event packet(const std::string& name, const Bytes& bytes, bool is_command = false) {
    return {name, [=](FirmwarePair& pair) { pair.out(bytes); }, false, is_command};
}

Event bad(const std::string& name, std::size_t changed, std::uint8_t value) {
    Bytes bytes = command(5, 1'000);
    bytes.at(changed) = value;
    return packet(name, bytes);
}

const std::vector<Event>& events() {
    static const std::vector<Event> all = [] {
        Bytes cut = command(5, 1'000);
        cut.pop_back();
        Bytes padded = command(5, 1'000);
        padded.resize(64);
        std::vector<Event> events{
            request("ENABLE 0", 2, 0, true),
            request("ENABLE 1", 2, 1, true),
            request("ENABLE 2", 2, 2, true),
            request("ZERO", 3, 0),
            request("WATCHDOG 1", 4, 1),
            request("WATCHDOG 2", 4, 2),
            request("WATCHDOG 1000", 4, 1000),
            request("WATCHDOG 1001", 4, 1001),
            request("CLEAR", 5, 0, true),
            request("RENDERER 0", 7, 0, true),
            request("RENDERER 1", 7, 1),
            request("RENDERER 2", 7, 2),
            request("GET_INFO in the wrong direction", 1, 0),
            request("unknown request", 8, 0),
            {"request with data", [](FirmwarePair& pair) { pair.control(setup(to_device, 2, 1, 2)); }},
            {"request to another recipient", [](FirmwarePair& pair) { pair.control(setup(0x40, 2, 1)); }},
            {"GET_INFO", [](FirmwarePair& pair) { pair.control(setup(to_host, 1, 0, 64)); }},
            {"first bytes of GET_INFO", [](FirmwarePair& pair) { pair.control(setup(to_host, 1, 0, 3)); }},
            {"GET_MODEL", [](FirmwarePair& pair) { pair.control(setup(to_host, 6, 0, 64)); }},
            packet("command", command(7, 1'234), true),
            packet("command above the limit", command(8, -700'000), true),
            packet("command that ends at once", command(9, 1'000, 0), true),
            packet("command for a long time", command(10, 1'000, 60'000), true),
            packet("empty packet", {}),
            packet("short packet", cut),
            packet("long packet", padded),
            bad("wrong first byte", 0, 'H'),
            bad("wrong version", 1, 2),
            bad("wrong flags", 9, 1),
            {"disarm", [](FirmwarePair& pair) { pair.disarm(); }, true},
            {"no fault", [](FirmwarePair& pair) { pair.fault(0); }},
            {"tick", [](FirmwarePair& pair) { pair.tick(100, 120); }},
            {"tick far away", [](FirmwarePair& pair) { pair.tick(100, -3'000); }},
            {"tick after 15 ms", [](FirmwarePair& pair) { pair.tick(15'000, 121); }},
            {"tick after 1.1 s", [](FirmwarePair& pair) { pair.tick(1'100'000, 122); }},
        };
        for (const std::uint16_t fault : {16, 32, 64, 112}) {
            events.push_back(
                {"fault " + std::to_string(fault), [=](FirmwarePair& pair) { pair.fault(fault); }, true});
        }
        return events;
    }();
    return all;
}

/// The state of a device without counters and times.
auto state_of(const palpate_device& device) {
    return std::tuple{device.status,          device.present,          device.watchdog_ms, device.life_ms,
                      device.was_commanded,   device.uses_model,       device.runs_model,  device.has_command,
                      device.torque_uNm != 0, device.ramp_us >= 20'000};
}

/// Checks the laws that hold in every state.
void check_laws(const palpate_device& device) {
    EXPECT_LE(std::abs(device.torque_uNm), most_uNm);
    EXPECT_EQ(device.present & ~device.status, 0) << "a present fault is not in the status";
    const bool may_move = device.has_command && (device.status & PALPATE_ENABLED) != 0 &&
                          (device.status & (PALPATE_FAULTS | PALPATE_WATCHDOG)) == 0;
    EXPECT_TRUE(may_move || device.torque_uNm == 0);
    EXPECT_FALSE((device.status & PALPATE_ENABLED) != 0 && (device.status & PALPATE_EMERGENCY_STOP) != 0);
}

/// Checks that the torque is zero and stays zero without a further command.
void check_zero_torque(FirmwarePair& pair) {
    EXPECT_EQ(pair.first.state().torque_uNm, 0);
    for (int k = 0; k < 3; ++k) {
        pair.tick(100, 120);
        EXPECT_EQ(pair.first.state().torque_uNm, 0);
    }
}

void play(FirmwarePair& pair, const std::vector<std::size_t>& path) {
    for (const std::size_t k : path) {
        events().at(k).apply(pair);
    }
}

std::string names(const std::vector<std::size_t>& path) {
    std::string text;
    for (const std::size_t k : path) {
        text += (text.empty() ? "" : ", ") + events().at(k).name;
    }
    return text;
}

class EveryTransition : public testing::TestWithParam<bool> {};

TEST_P(EveryTransition, FollowsTheLawsInBothImplementations) {
    std::vector<std::vector<std::size_t>> paths{{}};
    std::set<decltype(state_of(palpate_device{}))> found;
    found.insert(state_of(FirmwarePair{small_device(GetParam())}.first.device()));
    for (std::size_t known = 0; known < paths.size() && !HasFailure(); ++known) {
        for (std::size_t k = 0; k < events().size(); ++k) {
            std::vector<std::size_t> path = paths.at(known);
            path.push_back(k);
            FirmwarePair pair{small_device(GetParam())};
            play(pair, path);
            pair.compare();
            check_laws(pair.first.device());
            if (found.insert(state_of(pair.first.device())).second) {
                paths.push_back(path);
            }
            if (events().at(k).sets_zero_torque) {
                check_zero_torque(pair);
            }
            ASSERT_FALSE(HasFailure()) << names(path);
        }
    }
    RecordProperty("transitions", static_cast<int>(paths.size() * events().size()));
    EXPECT_GT(paths.size(), GetParam() ? 500U : 300U);
    std::cout << paths.size() << " states, " << paths.size() * events().size() << " transitions\n";
}

INSTANTIATE_TEST_SUITE_P(Device, EveryTransition, testing::Bool(), [](const auto& parameter) {
    return parameter.param ? "with_a_model" : "without_a_model";
});

/// Returns a random event that ends after any clock and position.
void apply_random(FirmwarePair& pair, std::mt19937_64& random) {
    const auto below = [&](std::uint64_t end) { return random() % end; };
    const auto any_count = [&] { return static_cast<std::int32_t>(below(2) == 0 ? below(4'000) : random()); };
    switch (below(8)) {
        case 0:
            pair.tick(static_cast<std::uint32_t>(below(40'000)), 0x7FFF'FF00 - static_cast<int>(below(900)));
            return;
        case 1:
        case 2:
            pair.tick(static_cast<std::uint32_t>(below(1'000)), static_cast<std::int32_t>(below(900)));
            return;
        case 3:
        case 4:
            pair.out(command(static_cast<std::uint16_t>(random()), any_count(),
                             static_cast<std::uint16_t>(below(below(2) == 0 ? 30 : 0x10000))));
            return;
        case 5:
            pair.control(setup(to_device, 2, 1));
            return;
        default:
            events().at(below(events().size())).apply(pair);
    }
}

TEST(RandomSequences, AreExecutedEquallyByBothImplementations) {
    for (int seed = 0; seed < cases(1'000); ++seed) {
        std::mt19937_64 random{static_cast<std::uint64_t>(seed)};
        FirmwarePair pair{small_device(seed % 4 != 0)};
        for (int k = 0; k < 200; ++k) {
            apply_random(pair, random);
            pair.compare();
            check_laws(pair.first.device());
            ASSERT_FALSE(testing::Test::HasFailure()) << "seed " << seed << ", event " << k;
        }
    }
    std::cout << cases(1'000) << " sequences of 200 events\n";
}

// After the host has ended in any way, the torque must end: at once after an event, otherwise by the watchdog.
TEST(RandomSequences, EndWithZeroForceWithinOnePacketOrByTheWatchdog) {
    int with_force = 0;
    for (int seed = 0; seed < cases(1'000); ++seed) {
        std::mt19937_64 random{static_cast<std::uint64_t>(seed) + 1'000'000};
        FirmwarePair pair{small_device()};
        for (std::uint64_t k = random() % 60; k > 0; --k) {
            apply_random(pair, random);
        }
        const auto life_ms = static_cast<std::uint16_t>(random() % 50);
        pair.fault(0);
        pair.control(setup(to_device, 5, 0));
        pair.control(setup(to_device, 7, static_cast<std::uint16_t>(random() % 2)));
        pair.control(setup(to_device, 2, 1));
        pair.out(command(1, 3'000, life_ms));
        for (int k = 0; k < 25; ++k) {  // longer than the ramp of the model
            pair.tick(1'000, 300);
            if (k < 24) {
                pair.out(command(static_cast<std::uint16_t>(k), 3'000, life_ms));
            }
        }
        with_force += pair.first.state().torque_uNm != 0 ? 1 : 0;
        const std::size_t end = random() % (2 * events().size());
        if (end < events().size() && events().at(end).sets_zero_torque) {
            events().at(end).apply(pair);
            const Bytes sent = pair.first.in();
            EXPECT_EQ(emulator::get<std::int32_t>(sent, 16), 0) << events().at(end).name;
        } else {
            for (std::uint32_t k = 0; k <= 10U * std::min(life_ms, pair.first.device().watchdog_ms); ++k) {
                pair.tick(100, 300);
                pair.out(k % 2 == 0 ? Bytes{} : Bytes(16));  // packets that are not commands
            }
        }
        for (int k = 0; k < 10; ++k) {
            EXPECT_EQ(pair.first.state().torque_uNm, 0) << "seed " << seed;
            pair.tick(1'000, 300);
        }
        ASSERT_FALSE(testing::Test::HasFailure());
    }
    EXPECT_GT(with_force, cases(1'000) / 2);
    std::cout << cases(1'000) << " sequences, " << with_force
              << " of them ended while the motor made force\n";
}

}  // namespace
}  // namespace palpate::test
