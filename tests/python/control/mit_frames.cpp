// SPDX-License-Identifier: Apache-2.0
// Reads lines "P_MAX V_MAX T_MAX position velocity kp kd torque" and prints the frame of each as 16 hexadecimal digits.
#include "palpate/device/mit_wire.hpp"

#include <cstdio>

int main() {
    palpate::mit::Ranges ranges;
    palpate::mit::Fields fields;
    while (std::scanf("%lf %lf %lf %lf %lf %lf %lf %lf", &ranges.position, &ranges.velocity, &ranges.torque,
                      &fields.position, &fields.velocity, &fields.stiffness, &fields.damping,
                      &fields.torque) == 8) {
        for (const unsigned byte : palpate::mit::frame_of(fields, ranges)) {
            std::printf("%02x", byte);
        }
        std::printf("\n");
    }
}
