// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "coupled_maps.hpp"
#include "palpate/rendering/energy_consistent.hpp"
#include "palpate/rendering/massless.hpp"
#include "palpate/solver/newton.hpp"

namespace palpate::bench {

/// Returns true if the load-line solver finds different positions when it starts from different positions.
[[nodiscard]] inline bool jumps_branches(double p, double falling) noexcept {
    constexpr int lines = 400;
    const SnappingObject object{falling, 0.1};
    const LoadLineSolver solver{.max_evaluations = 10'000, .longest_step = 1e-3};
    for (int k = 0; k <= lines; ++k) {
        const LoadLine line{p, falling * 0.1 * (2.0 * k / lines - 1.0)};
        const Solution up = solver.solve(object, {}, line, -0.3);
        const Solution down = solver.solve(object, {}, line, 0.3);
        if (std::abs(up.position - down.position) > 1e-6) {
            return true;
        }
    }
    return false;
}

/// Returns true if the iteration y <- (q - f(y)) / p for the load line f(y) + p y = q diverges for a spring f.
[[nodiscard]] inline bool iteration_diverges(double p, double stiffness) noexcept {
    constexpr int most = 100'000;
    double y = 1.0;
    for (int k = 0; k < most && std::abs(y) < 1e6; ++k) {
        if (std::abs(y) < 1e-6) {
            return false;
        }
        y = -stiffness * y / p;
    }
    return true;
}

/// Map: slope limit of the solvers over the sample time. The solution is unique if p + min f' > 0, and the fixed-point
/// iteration converges if max |f'| < p. The slope p of the load line is that of the default coupling and inertia.
[[nodiscard]] inline FailureMap solver_map(int points) {
    FailureMap map{"solver", "sample time T [s]", "steepest slope [N*m/rad]", {}};
    const auto massless = [](double period) {
        return Massless<LinearObject>::load_line_slope(VirtualCoupling{}, period);
    };
    const auto implicit = [](double period) {
        return Implicit<LinearObject>::load_line_slope(Inertia{}, VirtualCoupling{}, period);
    };
    const std::vector<double> periods = logarithmic(1e-4, 1e-2, points);
    map.lines.push_back(failure_line(
        "massless: branch jumps", periods, massless,
        [&](double period, double slope) { return jumps_branches(massless(period), slope); }, 3.0));
    map.lines.push_back(failure_line(
        "implicit: branch jumps", periods, implicit,
        [&](double period, double slope) { return jumps_branches(implicit(period), slope); }, 3.0));
    map.lines.push_back(failure_line(
        "massless: fixed point diverges", periods, massless,
        [&](double period, double slope) { return iteration_diverges(massless(period), slope); }, 3.0));
    return map;
}

/// Ratio of the displacements of two consecutive ticks at a held device over the stiffness. The energy-consistent
/// step without its switch, (B_c/T - K/2) / (K_c + B_c/T + K/2), rings as the ratio approaches -1. The switched step
/// and backward Euler do not ring.
[[nodiscard]] inline FailureMap pole_map(int points) {
    constexpr double period = 1e-3;
    constexpr VirtualCoupling coupling;
    const double beta = coupling.damping / period;
    FailureMap map{"pole", "stiffness K [N*m/rad]", "ratio of the displacements of two ticks", {}};
    map.linear = true;
    const auto ratio_of_displacements = [](auto structure) {
        structure.reset(0.0);
        (void)structure.step(0.01);
        const double before = structure.step(0.0).environment_position;
        return structure.step(0.0).environment_position / before;
    };
    const std::vector<double> stiffness = logarithmic(1.0, 1e5, points);
    FailureLine unswitched{"energy-consistent without its switch", stiffness, {}, {}};
    FailureLine switched{"energy-consistent with its switch", stiffness, {}, {}};
    FailureLine backward{"backward Euler", stiffness, {}, {}};
    for (const double k : stiffness) {
        const Inertia none{0.0, 0.0};
        const double euler = beta / (coupling.stiffness + beta + k);
        unswitched.measured.push_back(
            ratio_of_displacements(EnergyConsistent{LinearObject{k}, none, coupling, period, 1e-7, false}));
        unswitched.theory.push_back((beta - 0.5 * k) / (coupling.stiffness + beta + 0.5 * k));
        switched.measured.push_back(
            ratio_of_displacements(EnergyConsistent{LinearObject{k}, none, coupling, period, 1e-7, true}));
        switched.theory.push_back(std::numeric_limits<double>::quiet_NaN());
        backward.measured.push_back(ratio_of_displacements(Massless{LinearObject{k}, coupling, period}));
        backward.theory.push_back(euler);
    }
    map.lines = {unswitched, switched, backward};
    return map;
}

}  // namespace palpate::bench
