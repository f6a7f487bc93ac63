// SPDX-License-Identifier: Apache-2.0
// Answers and packets of a USB device, of any length and content. A packet is read or counted as malformed; readings
// are finite numbers, counters never decrease, and a command is within the largest torque of the device.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>

#include "fuzzing.hpp"
#include "palpate/device/packet_stream.hpp"
#include "palpate/device/wire.hpp"

namespace palpate::fuzz {
namespace {

/// Returns the device of the input, or a usual one if the bytes of the input are refused.
wire::Info device_of(Input& input) {
    wire::Info info;
    if (const std::string reason = wire::decode(input.take_bytes(wire::info_size), info); reason.empty()) {
        require(
            info.counts_per_rev > 0 && info.max_torque_uNm > 0 && info.rate_hz > 0 && info.watchdog_ms > 0,
            "the properties of a device are > 0");
        return info;
    }
    return {0x0100, 65536, 5'000'000, 1000, 20, 3, 7};
}

void check_reading(const Reading& reading, bool has_transducer) {
    for (const double value : {reading.position, reading.velocity, reading.applied, reading.device_time}) {
        require(std::isfinite(value), "a reading is finite");
    }
    require(std::isnan(reading.measured) != has_transducer,
            "a force is measured if the device has a transducer");
}

/// Counters of a stream, without its histograms.
struct Counters {
    explicit Counters(const StreamHealth& health)
        : packets{health.packets + health.malformed},
          lost{health.lost},
          rare{health.repeated, health.late_echoes, health.watchdog_trips, health.refused_commands} {}

    std::uint64_t packets;
    std::uint64_t lost;
    std::array<std::uint64_t, 4> rare;
};

void check_health(const Counters& before, const Counters& now) {
    require(now.packets == before.packets + 1, "each packet is counted");
    require(now.lost >= before.lost && now.lost - before.lost < 32768, "lost samples are counted");
    for (std::size_t k = 0; k < now.rare.size(); ++k) {
        require(now.rare[k] - before.rare[k] <= 1, "a packet counts once");
    }
}

void check_command(const wire::OutPacket& command, const wire::Info& info) {
    require(std::abs(std::int64_t{command.torque_uNm}) <= info.max_torque_uNm,
            "a command is within the largest torque");
    const auto bytes = wire::encode(command);
    require(bytes[0] == 'T' && bytes[1] == wire::protocol_version, "a command begins with T and the version");
}

void run(Input& input) {
    const wire::Info info = device_of(input);
    wire::DeviceModel model;
    if (wire::decode(input.take_bytes(wire::model_size), model).empty()) {
        require(model.rate_hz > 0 && model.renderer <= wire::Renderer::Device, "a model has a rate");
        require(wire::difference(model, model).empty(), "a model does not differ from itself");
    }
    PacketStream stream{info};
    Nanoseconds now = 0;
    while (!input.empty()) {
        now += input.take<std::uint32_t>();
        switch (input.take<std::uint8_t>() % 4) {
            case 0: {  // a packet of the right size
                const Counters before{stream.health()};
                if (stream.take(input.take_bytes(wire::in_size), now)) {
                    check_reading(stream.reading(), (info.capabilities & wire::has_transducer) != 0);
                }
                check_health(before, Counters{stream.health()});
                break;
            }
            case 1: {  // a fragment, or a packet with further bytes
                const auto bytes = input.take_bytes(input.take<std::uint8_t>() % (wire::largest_packet + 1));
                require(!stream.take(bytes, now) || bytes.size() == wire::in_size,
                        "a fragment is not read as a packet");
                break;
            }
            case 2: {
                const auto force = input.take<double>();
                const wire::OutPacket command = stream.next_command(force, input.take<std::uint16_t>(), now);
                check_command(command, info);
                stream.sent(command, now);
                break;
            }
            default:
                stream.pause();
                require(!stream.follows(), "the next packet does not count lost samples");
        }
    }
}

}  // namespace
}  // namespace palpate::fuzz

FUZZ_TARGET(packets) {
    palpate::fuzz::Input input{data, size};
    palpate::fuzz::run(input);
    return 0;
}
