// SPDX-License-Identifier: Apache-2.0
//
// Renders a wall on knobs with less and less damping, and compares the certificate with the oscillation.
// 09_certificate_and_device.py explains each step and does the same in Python.
//
//     c++ -std=c++20 -O2 -I cpp/include examples/09_certificate_and_device.cpp -o certificate && ./certificate

#include <algorithm>
#include <cstdio>
#include <string>

#include "palpate/palpate.hpp"

int main() {
    using namespace palpate;

    // The object: a wall of 100 N*m/rad without wavelets.
    const NetworkParameters line{
        .dimension = 1, .alpha = {}, .beta = {}, .weight = {}, .linear = {100.0}, .bias = 0.0};
    Domain range;
    range.lower = {0.0};
    range.upper = {0.1};
    const ForceModel wall{line, range};
    Scheme direct;
    direct.structure = StructureKind::Direct;

    // A hand without damping pulls the knob into the wall.
    Hand hand;
    hand.stiffness = 5.0;
    hand.damping = 0.0;
    hand.lower = 0.05;
    hand.upper = 0.2;
    hand.frequency_hz = 0.1;

    double required = 0.0;
    double oscillating = 0.0;
    double worst = 0.0;
    for (const double damping : {0.06, 0.055, 0.05, 0.045, 0.04, 0.03, 0.02, 0.01}) {
        DeviceProfile knob;
        knob.viscous_damping = damping;
        knob.coulomb_friction = 0.005;
        const Certificate certificate = certify(wall, direct, knob);
        const Trace trace = simulate(wall, direct, knob, hand, 4000);
        const auto [least, most] = std::minmax_element(trace.position.end() - 1000, trace.position.end());
        const double swing = *most - *least;
        required = certificate.inequalities.front().right;
        oscillating = swing > 0.01 ? std::max(oscillating, damping) : oscillating;
        worst = certificate.certified() ? std::max(worst, swing) : worst;
        const std::string verdict{words_of<Verdict>[static_cast<std::size_t>(certificate.verdict)]};
        std::printf("b = %.3f N*m*s/rad: %-9s swing %.1f mrad\n", damping, verdict.c_str(), 1e3 * swing);
    }
    std::printf("required b > %.4f, oscillation at b <= %.3f N*m*s/rad\n", required, oscillating);
    std::printf("largest swing with a certificate %.1f mrad\n", 1e3 * worst);
}
