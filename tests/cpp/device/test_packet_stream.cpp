// SPDX-License-Identifier: Apache-2.0
#include "palpate/device/packet_stream.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "packet.hpp"
#include "palpate/device/wire.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::Bytes;
using test::knob;
using test::Packet;

constexpr Nanoseconds ms = 1'000'000;

TEST(PacketStream, MakesReadingsInSiWithTheSignsOfThisLibrary) {
    PacketStream stream = PacketStream{knob()};
    ASSERT_TRUE(stream.take(Packet{10, 5'000'000, 16384, -32768, -300'000, 1, 0, 0, -250'000}.bytes(), 0));
    const Reading& reading = stream.reading();
    EXPECT_NEAR(reading.position, 0.5 * std::numbers::pi, 1e-15);
    EXPECT_NEAR(reading.velocity, -std::numbers::pi, 1e-15);
    EXPECT_NEAR(reading.applied, 0.3, 1e-15);
    EXPECT_NEAR(reading.measured, 0.25, 1e-15);
    EXPECT_NEAR(reading.device_time, 5.0, 1e-12);
    EXPECT_EQ(reading.sequence, 10U);
    EXPECT_EQ(reading.status, Status::Ok);
}

TEST(PacketStream, HasNoMeasuredForceWithoutATransducerAndComputesAMissingVelocity) {
    PacketStream stream = PacketStream{knob(0)};
    ASSERT_TRUE(stream.take(Packet{1, 1000, 100, 77, 0, 1, 0, 0, 9}.bytes(), 0));
    EXPECT_TRUE(std::isnan(stream.reading().measured));
    EXPECT_EQ(stream.reading().velocity, 0.0);
    ASSERT_TRUE(stream.take(Packet{3, 3000, 110, 77, 0, 1, 0, 0, 9}.bytes(), 0));  // one was lost
    EXPECT_NEAR(stream.reading().velocity, wire::position_of(10, 65536) / 2e-3, 1e-9);
}

TEST(PacketStream, ClockAndSequenceContinueWhenTheirCountersWrap) {
    PacketStream stream = PacketStream{knob()};
    std::uint16_t sequence = 65'530;
    std::uint32_t clock = 4'294'960'000U;
    double last = -1.0;
    for (int k = 0; k < 20; ++k) {
        ASSERT_TRUE(stream.take(Packet{sequence++, clock, 0, 0, 0, 1, 0, 0, 0}.bytes(), 0));
        clock += 1000;
        if (k > 0) {
            EXPECT_NEAR(stream.reading().device_time - last, 1e-3, 1e-9);
        }
        last = stream.reading().device_time;
        EXPECT_EQ(stream.reading().sequence, 65'530U + static_cast<std::uint64_t>(k));
    }
    EXPECT_EQ(stream.health().lost, 0U);
}

TEST(PacketStream, CountsLostRepeatedAndMalformedPackets) {
    PacketStream stream = PacketStream{knob()};
    for (const std::uint16_t sequence : {1, 2, 5, 5, 4, 6, 10}) {
        EXPECT_TRUE(stream.take(Packet{sequence, 0, 0, 0, 0, 1, 0, 0, 0}.bytes(), 0));
    }
    Bytes wrong = Packet{}.bytes();
    wrong.pop_back();
    EXPECT_FALSE(stream.take(wrong, 0));
    EXPECT_EQ(stream.health().packets, 7U);
    EXPECT_EQ(stream.health().repeated, 2U);
    EXPECT_EQ(stream.health().malformed, 1U);
    // Two packets are lost between the numbers 2 and 5, one between the repeated packet 4 and 6, and three between 6
    // and 10.
    EXPECT_EQ(stream.health().lost, 2U + 1U + 3U);
}

TEST(PacketStream, MeasuresRoundTripAndDelayFromTheEcho) {
    PacketStream stream = PacketStream{knob()};
    // The device still echoes a packet of an earlier session, whose sequence number is close to the overflow of the
    // 16-bit counter.
    ASSERT_TRUE(stream.take(Packet{0, 0, 0, 0, 0, 1, 65'535, 100, 0}.bytes(), 0));
    for (int k = 0; k < 100; ++k) {
        const wire::OutPacket command = stream.next_command(0.1, 10, k * ms);
        EXPECT_EQ(command.sequence, static_cast<std::uint16_t>(k));
        stream.sent(command, k * ms);
        // The device accepts the command 300 us before it latches the encoder of the next sample; the sample arrives
        // 1.25 ms after the command was sent.
        ASSERT_TRUE(
            stream.take(Packet{static_cast<std::uint16_t>(k + 1), static_cast<std::uint32_t>(k + 1) * 1000, 0,
                               0, 0, 1, command.sequence, 300, 0}
                            .bytes(),
                        k * ms + 1'250'000));
    }
    EXPECT_EQ(stream.health().round_trip.count(), 100U);
    EXPECT_NEAR(stream.health().round_trip.quantile(0.5), 1.25e6, 5e3);
    EXPECT_NEAR(stream.health().delay.quantile(1.0), 0.7e6, 3e3);
    EXPECT_EQ(stream.health().late_echoes, 0U);
}

TEST(PacketStream, EchoOfAnEarlierSessionIsCountedAndNotMeasured) {
    PacketStream stream = PacketStream{knob()};
    ASSERT_TRUE(stream.take(Packet{0, 0, 0, 0, 0, 1, 7, 0, 0}.bytes(), 0));
    for (int k = 0; k < 3; ++k) {
        stream.sent(stream.next_command(0.0, 10, 0), 0);
    }
    for (const std::uint16_t echo : {10, 9, 20'000, 10}) {
        ASSERT_TRUE(stream.take(Packet{1, 0, 0, 0, 0, 1, echo, 0, 0}.bytes(), 0));
    }
    EXPECT_EQ(stream.health().late_echoes, 2U);
    EXPECT_EQ(stream.health().round_trip.count(), 1U);
}

/// Delay of the reading of one packet after another: sample number, time and echo of the packet.
class Delays {
  public:
    /// Reads the packet of a sample; the device accepted the command `echo` by `age_us` before it.
    double at(std::uint16_t sequence, std::uint32_t clock_us, std::uint16_t echo, std::uint16_t age_us = 0) {
        EXPECT_TRUE(stream_.take(Packet{sequence, clock_us, 0, 0, 0, 1, echo, age_us, 0}.bytes(), 0));
        return stream_.reading().delay;
    }
    void send() { stream_.sent(stream_.next_command(0.1, 10, 0), 0); }

  private:
    PacketStream stream_{knob()};
};

TEST(PacketStream, ACommandThatTheDeviceIgnoresIsLateFromTheNextSampleOn) {
    Delays delays;
    EXPECT_TRUE(std::isnan(delays.at(0, 0, 0))) << "no command was sent";
    for (int k = 1; k <= 8; ++k) {
        delays.send();
        EXPECT_NEAR(delays.at(static_cast<std::uint16_t>(k), 1000U * static_cast<std::uint32_t>(k), 0),
                    1e-3 * k, 1e-12);
    }
    delays.send();
    EXPECT_NEAR(delays.at(9, 9000, 9, 200), 8.8e-3, 1e-12) << "accepted at 8.8 ms, late from 0 ms on";
    delays.send();
    EXPECT_NEAR(delays.at(10, 10'000, 10, 200), 0.8e-3, 1e-12) << "in time again";
}

TEST(PacketStream, AnEchoThatDoesNotAdvanceIsLate) {
    Delays delays;
    (void)delays.at(0, 0, 0);
    for (int k = 1; k <= 20; ++k) {
        delays.send();
        const auto number = static_cast<std::uint16_t>(k);
        EXPECT_NEAR(delays.at(number, 1000U * number, std::min<std::uint16_t>(number, 5)),
                    1e-3 * std::max(1, k - 5), 1e-12);
    }
}

TEST(PacketStream, ACommandThatTheHostSkipsIsLate) {
    Delays delays;
    (void)delays.at(0, 0, 0);
    delays.send();
    EXPECT_NEAR(delays.at(1, 1000, 1, 900), 0.1e-3, 1e-12);
    EXPECT_NEAR(delays.at(2, 2000, 1, 1900), 1e-3, 1e-12) << "the force does not contain the sample of 1 ms";
    delays.send();
    EXPECT_NEAR(delays.at(3, 3000, 2, 900), 1.1e-3, 1e-12);
}

TEST(PacketStream, LostSamplesAreLate) {
    Delays delays;
    (void)delays.at(0, 0, 0);
    delays.send();
    EXPECT_NEAR(delays.at(4, 4000, 1, 3900), 3e-3, 1e-12) << "the samples of 1, 2 and 3 ms did not arrive";
}

TEST(PacketStream, AStoppedClockDoesNotHideALateCommand) {
    Delays delays;
    (void)delays.at(0, 5000, 0);
    delays.send();
    EXPECT_EQ(delays.at(1, 5000, 1), 0.0);
    for (int k = 2; k < 9; ++k) {
        delays.send();
        EXPECT_NEAR(delays.at(static_cast<std::uint16_t>(k), 5000, 1), 1e-3 * (k - 1), 1e-12);
    }
}

TEST(PacketStream, AJumpOfTheClockIsLate) {
    Delays delays;
    (void)delays.at(0, 0, 0);
    delays.send();
    (void)delays.at(1, 1000, 1);
    delays.send();
    EXPECT_GT(delays.at(2, 500'000, 1), 0.4);
}

// A device in virtual time loses, delays and ignores packets at random. The delay is never shorter than the true time
// by which the force was late, and equal to it if the device accepted at most one command between two packets.
TEST(PacketStream, TheDelayIsNeverShorterThanTheTruth) {
    test::Random random{35};
    const auto happens = [&](double probability) { return test::uniform(random, 0.0, 1.0) < probability; };
    int equal = 0;
    for (int run = 0; run < test::cases(100); ++run) {
        const double fault = run % 4 == 0 ? 0.0 : test::uniform(random, 0.0, 0.3);
        const double longest_us = test::uniform(random, 200.0, 4000.0);
        struct Accepted {
            std::uint16_t sequence;
            std::int64_t us;
            std::int64_t late_from_us;  ///< time of the sample after that of the command
        };
        std::vector<Accepted> accepted;
        PacketStream stream{knob()};
        std::int64_t last_read_us = -1;
        std::int64_t last_accepted_us = 0;
        std::int64_t first_sample_us = -1;
        for (std::uint16_t k = 0; k < 500; ++k) {
            const std::int64_t now_us = 1000 * std::int64_t{k};
            if (k > 0 && happens(fault)) {
                continue;  // this packet does not arrive
            }
            // The truth: each command acts until the next one is accepted
            Accepted in_force{0, 0, first_sample_us};
            double truth = 0.0;
            int new_ones = 0;
            for (const Accepted& command : accepted) {
                if (command.us > now_us) {
                    break;
                }
                if (command.us > last_read_us) {
                    truth = std::max(truth, 1e-6 * static_cast<double>(command.us - in_force.late_from_us));
                    ++new_ones;
                }
                in_force = command;
            }
            truth = std::max(truth, 1e-6 * static_cast<double>(now_us - in_force.late_from_us));
            const auto age_us =
                static_cast<std::uint16_t>(std::min<std::int64_t>(65'535, now_us - in_force.us));
            ASSERT_TRUE(stream.take(
                Packet{k, static_cast<std::uint32_t>(now_us), 0, 0, 0, 1, in_force.sequence, age_us, 0}
                    .bytes(),
                0));
            if (first_sample_us >= 0) {
                ASSERT_GE(stream.reading().delay, truth - 1e-12) << run << " " << k;
                if (new_ones <= 1) {
                    ASSERT_NEAR(stream.reading().delay, truth, 1e-12) << run << " " << k;
                    ++equal;
                }
            }
            last_read_us = now_us;
            if (happens(fault)) {
                continue;  // the host skips this command
            }
            first_sample_us = first_sample_us < 0 ? now_us : first_sample_us;
            const wire::OutPacket command = stream.next_command(0.1, 10, 0);
            stream.sent(command, 0);
            if (!happens(fault)) {  // otherwise the device ignores this command
                const auto transit_us = static_cast<std::int64_t>(test::uniform(random, 100.0, longest_us));
                last_accepted_us = std::max(last_accepted_us + 1, now_us + transit_us);
                accepted.push_back({command.sequence, last_accepted_us, now_us + 1000});
            }
        }
    }
    EXPECT_GT(equal, test::cases(100) * 100);
}

TEST(PacketStream, StatusIsThatOfTheMostSeriousBit) {
    const auto status = [](std::uint16_t bits) {
        PacketStream stream = PacketStream{knob()};
        EXPECT_TRUE(stream.take(Packet{0, 0, 0, 0, 0, wire::enabled, 0, 0, 0}.bytes(), 0));
        stream.sent(stream.next_command(0.0, 10, 0), 0);
        EXPECT_TRUE(stream.take(Packet{1, 0, 0, 0, 0, bits, 1, 0, 0}.bytes(), 0));
        return stream.reading().status;
    };
    EXPECT_EQ(status(1), Status::Ok);
    EXPECT_EQ(status(1 | 4), Status::Limited);
    EXPECT_EQ(status(1 | 2 | 4), Status::Timeout);
    EXPECT_EQ(status(1 | 8), Status::Lost);
    EXPECT_EQ(status(1 | 16), Status::Fault);
    EXPECT_EQ(status(1 | 32), Status::Fault);
    EXPECT_EQ(status(1 | 64), Status::Fault);
    // The previous packet had the enabled bit of the status, this packet has not
    EXPECT_EQ(status(0), Status::Fault);
}

TEST(PacketStream, IgnoresAWatchdogTripOfAnEarlierSession) {
    PacketStream stream = PacketStream{knob()};
    ASSERT_TRUE(stream.take(Packet{0, 0, 0, 0, 0, 3, 500, 0, 0}.bytes(), 0));
    EXPECT_EQ(stream.reading().status, Status::Ok);
    stream.sent(stream.next_command(0.0, 10, 0), 0);
    ASSERT_TRUE(stream.take(Packet{1, 0, 0, 0, 0, 1, 501, 0, 0}.bytes(), 0));
    ASSERT_TRUE(stream.take(Packet{2, 0, 0, 0, 0, 3, 501, 0, 0}.bytes(), 0));
    EXPECT_EQ(stream.reading().status, Status::Timeout);
    EXPECT_EQ(stream.health().watchdog_trips, 1U);
}

TEST(PacketStream, AcceptsAnyBytesAndReportsOnlyValidReadings) {
    test::Random random{4};
    PacketStream stream = PacketStream{knob()};
    for (int k = 0; k < test::cases(20'000); ++k) {
        Bytes bytes = Packet{}.bytes();
        for (std::size_t at = 2; at < bytes.size(); ++at) {
            bytes[at] = static_cast<std::uint8_t>(random());
        }
        EXPECT_TRUE(stream.take(bytes, static_cast<Nanoseconds>(random() % 1'000'000'000)));
        stream.sent(stream.next_command(0.0, 10, 0), 0);
        EXPECT_TRUE(std::isfinite(stream.reading().position));
        EXPECT_TRUE(std::isfinite(stream.reading().velocity));
    }
}

}  // namespace
}  // namespace palpate
