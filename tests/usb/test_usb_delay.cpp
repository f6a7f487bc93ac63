// SPDX-License-Identifier: Apache-2.0
// The loop on an emulated device with faults that make forces old: after each reading that the loop accepts, the force
// of the motor is at most as old as allowed. Each force of this test is the number of the sample from which it was
// computed, so that the torque of a packet states the age of the force independently of all other fields.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "../cpp/support.hpp"
#include "emulated_machine.hpp"
#include "palpate/device/usb.hpp"
#include "palpate/run/controller.hpp"
#include "palpate/run/loop.hpp"

namespace palpate {
namespace {

constexpr int allowed_samples = 4;
constexpr std::uint64_t numbers = 10'000;  ///< number of samples with different forces

/// Sends the number of the last sample in place of each force [uN*m].
struct NumberingDevice {
    static constexpr bool paces_host = true;
    UsbDevice device;
    std::uint64_t last = 0;

    Opened open() { return device.open(); }
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        const double number = 1e-6 * static_cast<double>(1 + last % numbers);
        const Reading reading = device.exchange({command.force == 0.0 ? 0.0 : number});
        last = reading.sequence;
        return reading;
    }
    ZeroForce close() noexcept { return device.close(); }

    /// Returns the number of samples between the sample after that of the motor's force and the sample of a reading.
    [[nodiscard]] static int late_samples(const Reading& reading) {
        const auto number = static_cast<std::uint64_t>(std::llround(1e6 * reading.applied)) - 1;
        return static_cast<int>((reading.sequence - number + 9 * numbers - 1) % numbers);
    }
};

/// A constant force, which is not a number from a tick on.
struct ConstantForce {
    int ticks = std::numeric_limits<int>::max();

    void reset(double /*position*/) noexcept {}
    [[nodiscard]] Rendered step(double position) noexcept {
        return {--ticks < 0 ? std::nan("") : 1.0, position, 0, Status::Ok, false};
    }
};

/// A clock that wakes the loop at once, a millisecond after the last wake-up; once later in tick `late_tick`.
struct EveryMillisecond {
    Nanoseconds now = 0;
    int late_tick = 0;
    int tick = 0;

    void start() noexcept {}
    [[nodiscard]] Wake wait() noexcept {
        now += ++tick == late_tick ? 9'000'000 : 1'000'000;
        return {.deadline = now, .now = now};
    }
};

/// Gives orders to the emulator before a tick, and checks every tick that sends a force.
struct Checker {
    std::vector<std::string> orders;
    int tick;
    int ticks = 0;
    int worst = 0;  ///< largest number of samples by which an accepted force was late
    int stop_tick = 0;
    std::atomic<bool> stop_requested{false};

    void push(const TickRecord& record) noexcept {
        if (++ticks == tick) {
            std::for_each(orders.begin(), orders.end(), test::send_order);
        }
        stop_requested = ticks == stop_tick;
        if (sends_force(record.status) && record.applied != 0.0) {
            Reading reading;
            reading.applied = record.applied;
            reading.sequence = record.sequence;
            worst = std::max(worst, NumberingDevice::late_samples(reading));
        }
    }
};

struct Result {
    int worst = 0;
    std::uint64_t ticks = 0;
    ExitReason reason{};
    Status status{};
    ZeroForce zero_force{};
};

/// A way in which a run of 0.1 s ends, unless a fault of the device ends it.
enum class Ending : std::uint8_t { TimeUp, Stop, Guard, LateTick };

/// Runs the loop and gives orders to the emulator in a tick; an ending other than TimeUp comes in the same tick.
Result run_with(const std::vector<std::string>& orders, int tick, int allowed = allowed_samples,
                Ending ending = Ending::TimeUp) {
    UsbOptions options;
    options.wait =
        std::chrono::milliseconds{ending == Ending::TimeUp ? 100 : 5};  // a connection fails within 100 ms
    NumberingDevice device{UsbDevice{options}};
    EXPECT_EQ(device.open().reason, "");
    ConstantForce force;
    EveryMillisecond clock;
    Checker checker{orders, tick};
    checker.stop_tick = ending == Ending::Stop ? tick : 0;
    clock.late_tick = ending == Ending::LateTick ? tick + 1 : 0;
    force.ticks = ending == Ending::Guard ? tick : force.ticks;
    Controller controller{device, force, Guards{.reading = ReadingGuard{{.longest_delay = 1e-3 * allowed}}}};
    LoopSettings settings;
    settings.duration_s = 0.1;
    settings.tolerated = 0;
    settings.lowest_rate_share = 0.0;
    settings.longest_period_s = 5e-3;
    const auto progress = std::make_unique<LoopProgress>();
    const auto report = std::make_unique<LoopReport>();
    run_loop(controller, settings, clock, checker.stop_requested, checker, *progress, *report);
    return {checker.worst, report->ticks(), report->exit_reason, report->status, report->zero_force};
}

constexpr std::array<std::string_view, 16> kinds{
    "deaf",        "busy",       "freeze", "mute", "skip",  "repeat", "old-echo", "stuck-echo",
    "stuck-clock", "clock-jump", "drop",   "swap", "burst", "slow",   "stall-in", "stall-out"};
constexpr std::array lengths{1, 3, 12};

TEST(UsbDelay, NoForceIsOlderThanAllowed) {
    test::Random random{1};
    std::uint64_t ticks = 0;
    int runs = 0;
    int ended_early = 0;
    int combinations = 0;
    for (int round = 0; round < test::cases(1); ++round) {
        for (const std::string_view kind : kinds) {
            for (const int length : lengths) {
                for (const bool watchdog : {true, false}) {
                    if (!test::is_sampled(combinations++, 5)) {
                        continue;
                    }
                    if (!watchdog) {
                        test::send_order("fault no-watchdog 500");
                    }
                    const std::string fault = "fault " + std::string(kind) + " " + std::to_string(length);
                    const int tick = 10 + static_cast<int>(random() % 60);
                    const Result result = run_with({fault}, tick);
                    ticks += result.ticks;
                    ++runs;
                    ended_early += result.reason == ExitReason::TimeUp ? 0 : 1;
                    EXPECT_LE(result.worst, allowed_samples) << fault << " in tick " << tick;
                    if (length > 2 * allowed_samples &&
                        (kind == "deaf" || kind == "stuck-echo" || kind == "freeze" || kind == "mute")) {
                        EXPECT_NE(result.reason, ExitReason::TimeUp) << fault << " in tick " << tick;
                    }
                    test::send_order("heal");
                    EXPECT_EQ(test::state("torque_uNm"), 0.0) << fault;
                }
            }
        }
    }
    std::cout << runs << " runs, " << ticks << " ticks, " << ended_early << " runs ended by a check\n";
}

// The test above can fail: without a limit of the delay, a deaf device applies old forces.
TEST(UsbDelay, WithoutALimitOldForcesAreAccepted) {
    test::send_order("fault no-watchdog 100");
    EXPECT_GT(run_with({"fault deaf 40"}, 20, 1'000'000).worst, 2 * allowed_samples);
    test::send_order("heal");
}

/// Compares the statement about zero force with what the emulated device received.
void expect_true(ZeroForce zero_force, const std::string& run) {
    const bool is_disabled = test::state("enabled") == 0.0;
    const bool got_zero = test::state("commanded_uNm") == 0.0;
    switch (zero_force) {
        case ZeroForce::Confirmed:
            EXPECT_TRUE(is_disabled) << run;
            EXPECT_EQ(test::state("torque_uNm"), 0.0) << run;
            break;
        case ZeroForce::Sent:
            EXPECT_TRUE(got_zero) << run;
            break;
        case ZeroForce::NotSent:
            EXPECT_FALSE(got_zero || is_disabled) << run;
            break;
        case ZeroForce::Commanded:
        case ZeroForce::Held:  // no USB device holds a position
            ADD_FAILURE() << run;
    }
}

TEST(UsbEnding, TheStatementAboutZeroForceIsTrueForEveryEndingAndConnection) {
    const std::vector<std::vector<std::string>> connections{{},
                                                            {"refuse 9"},
                                                            {"deaf 999"},
                                                            {"mute 999"},
                                                            {"freeze 999"},
                                                            {"stall-in 1"},
                                                            {"stall-out 1"},
                                                            {"stall-out 999"},
                                                            {"error-in 999"},
                                                            {"reset 1"},
                                                            {"encoder 999"},
                                                            {"emergency-stop 999"}};
    std::array<int, 4> statements{};
    int combinations = 0;
    for (const std::vector<std::string>& connection : connections) {
        for (const bool refuses : {false, true}) {
            for (const Ending ending : {Ending::TimeUp, Ending::Stop, Ending::Guard, Ending::LateTick}) {
                if (!test::is_sampled(combinations++, 7)) {
                    continue;
                }
                std::vector<std::string> orders;
                std::string run = "ending " + std::to_string(static_cast<int>(ending));
                for (const std::string& fault : connection) {
                    orders.push_back("fault " + fault);
                }
                if (refuses) {
                    orders.emplace_back("fault refuse 9");
                }
                for (const std::string& order : orders) {
                    run += ", " + order;
                }
                // The end of the duration is the last tick
                const Result result = run_with(orders, ending == Ending::TimeUp ? 98 : 40, 1000, ending);
                expect_true(result.zero_force, run);
                // Only a device that accepts neither a command nor the request to disable its torque gets no zero
                const bool is_deaf =
                    run.find("refuse") != run.npos &&
                    (run.find("freeze") != run.npos || run.find("stall-out 999") != run.npos);
                EXPECT_EQ(result.zero_force == ZeroForce::NotSent, is_deaf) << run;
                ++statements[static_cast<std::size_t>(result.zero_force)];
                test::send_order("heal");
                detail::UsbConnection connected;
                ASSERT_EQ(connected.open("").reason, "");
                ASSERT_EQ(connected.request(wire::Request::Clear, 0), 0)
                    << "faults stay until they are cleared";
            }
        }
    }
    std::cout << statements[1] << " not sent, " << statements[2] << " sent, " << statements[3]
              << " confirmed\n";
    EXPECT_GT(statements[2], 0);
    EXPECT_GT(statements[3], 0);
    const Result unplugged = run_with({"fault unplug 1"}, 40);
    EXPECT_EQ(unplugged.reason, ExitReason::DeviceFault);
    EXPECT_EQ(unplugged.zero_force, ZeroForce::NotSent);
}

}  // namespace
}  // namespace palpate
