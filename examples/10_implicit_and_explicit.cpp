// SPDX-License-Identifier: Apache-2.0
//
// Drives a detent with a known force and compares implicit and explicit integration over the period.
// 10_implicit_and_explicit.py explains each step and does the same in Python.
//
//     c++ -std=c++20 -O2 -I cpp/include examples/10_implicit_and_explicit.cpp -o integration && ./integration

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <numbers>
#include <vector>

#include "palpate/palpate.hpp"

namespace {

using namespace palpate;

/// Returns the position of the object [rad] while the force increases to 0.6 N*m and decreases, twice in a second.
std::vector<double> motion(const ForceModel& detent, StructureKind structure, double period) {
    std::vector<double> force;
    for (int k = 0; k < std::lround(1.0 / period); ++k) {
        force.push_back(0.3 * (1.0 - std::cos(4.0 * std::numbers::pi * (period * k))));
    }
    Scheme scheme;
    scheme.structure = structure;
    scheme.inertia.mass = 1e-4;
    scheme.inertia.damping = 0.02;
    std::vector<double> position;
    for (const Rendered& row : force_driven(detent, scheme, force, period, 0.0)) {
        position.push_back(row.environment_position);
    }
    return position;
}

}  // namespace

int main() {
    const NetworkParameters network{
        .dimension = 1, .alpha = {30.0}, .beta = {0.2}, .weight = {-0.3}, .linear = {2.0}, .bias = 0.0};
    Domain range;
    range.lower = {0.0};
    range.upper = {0.5};
    const ForceModel detent{network, range};

    const std::vector<double> exact = motion(detent, StructureKind::Explicit, 1e-6);
    const auto error = [&](StructureKind structure, double period) {
        const std::vector<double> position = motion(detent, structure, period);
        const auto every = static_cast<std::size_t>(std::lround(period / 1e-6));
        double sum = 0.0;
        for (std::size_t k = 0; k < position.size(); ++k) {
            sum += std::pow(position[k] - exact[k * every], 2);
        }
        return std::sqrt(sum / static_cast<double>(position.size()));
    };
    for (const double period : {1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3}) {
        std::printf("T = %4.1f ms: implicit %.3g mrad, explicit %.3g mrad RMS\n", 1e3 * period,
                    1e3 * error(StructureKind::Implicit, period),
                    1e3 * error(StructureKind::Explicit, period));
    }
    std::printf("at 1 kHz the error of explicit is %.2f times that of implicit\n",
                error(StructureKind::Explicit, 1e-3) / error(StructureKind::Implicit, 1e-3));
}
