// SPDX-License-Identifier: Apache-2.0
// Prints one frame for each line of standard input as hexadecimal digits.
//
//     can_frames mit       P_MAX V_MAX T_MAX position velocity kp kd torque
//     can_frames moteus    position velocity torque kp_scale kd_scale largest_torque timeout_s
#include <cstdint>
#include <cstdio>
#include <span>
#include <string_view>

#include "palpate/device/mit_wire.hpp"
#include "palpate/device/moteus_wire.hpp"

namespace {

void print(std::span<const std::uint8_t> bytes) {
    for (const unsigned byte : bytes) {
        std::printf("%02x", byte);
    }
    std::printf("\n");
}

}  // namespace

int main(int count, char** arguments) {
    if (count == 2 && std::string_view{arguments[1]} == "moteus") {
        palpate::moteus::Fields fields;
        while (std::scanf("%f %f %f %f %f %f %f", &fields.position, &fields.velocity, &fields.torque,
                          &fields.kp_scale, &fields.kd_scale, &fields.largest_torque,
                          &fields.timeout_s) == 7) {
            const palpate::moteus::Frame frame = palpate::moteus::frame_of(fields);
            print({frame.data.data(), frame.size});
        }
        return 0;
    }
    palpate::mit::Ranges ranges;
    palpate::mit::Fields fields;
    while (std::scanf("%lf %lf %lf %lf %lf %lf %lf %lf", &ranges.position, &ranges.velocity, &ranges.torque,
                      &fields.position, &fields.velocity, &fields.stiffness, &fields.damping,
                      &fields.torque) == 8) {
        print(palpate::mit::frame_of(fields, ranges));
    }
}
