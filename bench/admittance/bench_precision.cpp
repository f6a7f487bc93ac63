// SPDX-License-Identifier: Apache-2.0
// Measures time and error of the steps of an admittance display with periods from 8 ms to 1/16 ms. A measured force
// moves the object, which has a spring and a wall. The exact motion is the solution of m y'' = F(t) - f(y) - B_o y' by
// Runge-Kutta steps of 1/1024 ms. The explicit step must diverge beyond its stability limit only.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "palpate/model/compiled_network.hpp"
#include "palpate/rendering/energy_consistent.hpp"
#include "palpate/rendering/explicit.hpp"
#include "palpate/rendering/implicit.hpp"
#include "palpate/solver/newton.hpp"
#include "palpate/solver/resolvent.hpp"
#include "solvers/scene.hpp"

namespace {

using palpate::CompiledNetwork;

constexpr palpate::VirtualCoupling none{0.0, 0.0};
constexpr palpate::Inertia inertia{0.0003, 0.1};
constexpr double duration_s = 2.0;
constexpr double settled_s = 0.2;  // errors count from this time, after the initial transient
constexpr std::int64_t longest_ns = 8'000'000;
constexpr std::int64_t shortest_ns = 62'500;
constexpr int truth_steps = 64;  // integration steps of the exact motion in shortest_ns

const CompiledNetwork& object() {
    static const CompiledNetwork compiled{palpate::bench::spring_and_wall(16)};
    return compiled;
}

/// Returns the force of a hand [N*m] that presses through the whole object and into the wall.
double hand(double time) {
    return 3.0 - 2.8 * std::cos(std::numbers::pi * time) + 0.2 * std::sin(14.0 * std::numbers::pi * time);
}

/// Exact position of the virtual object at every multiple of shortest_ns.
const std::vector<double>& reference_positions() {
    static const std::vector<double> solution = [] {
        const auto acceleration = [](double time, double y, double v) {
            return (hand(time) - object().at(y, {}).force - inertia.damping * v) / inertia.mass;
        };
        constexpr double h = 1e-9 * shortest_ns / truth_steps;
        const auto samples = static_cast<std::size_t>(std::llround(1e9 * duration_s / shortest_ns));
        double y = 0.0;
        double v = 0.0;
        std::vector<double> at{y};
        for (std::size_t k = 0; k < samples; ++k) {
            for (int j = 0; j < truth_steps; ++j) {
                const double t = 1e-9 * shortest_ns * static_cast<double>(k) + h * j;
                const double a1 = acceleration(t, y, v);
                const double a2 = acceleration(t + 0.5 * h, y + 0.5 * h * v, v + 0.5 * h * a1);
                const double a3 =
                    acceleration(t + 0.5 * h, y + 0.5 * h * (v + 0.5 * h * a1), v + 0.5 * h * a2);
                const double a4 = acceleration(t + h, y + h * (v + 0.5 * h * a2), v + h * a3);
                y += h * v + h * h / 6.0 * (a1 + a2 + a3);
                v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
            }
            at.push_back(y);
        }
        return at;
    }();
    return solution;
}

/// Returns the RMS of simulated minus exact position from settled_s on; infinity if the motion diverges. Each step uses
/// the force at its start, as a display does.
template <class S>
double motion_error(S structure, std::int64_t period_ns) {
    const auto stride = static_cast<std::size_t>(period_ns / shortest_ns);
    structure.reset(0.0);
    double squares = 0.0;
    std::size_t counted = 0;
    for (std::size_t k = stride; k < reference_positions().size(); k += stride) {
        const double time = 1e-9 * shortest_ns * static_cast<double>(k);
        const palpate::Rendered moved = structure.drive(hand(time - 1e-9 * static_cast<double>(period_ns)));
        const double error = moved.environment_position - reference_positions()[k];
        if (moved.status != palpate::Status::Ok || !(std::abs(error) < 1.0)) {
            return std::numeric_limits<double>::infinity();
        }
        if (time >= settled_s) {
            squares += error * error;
            ++counted;
        }
    }
    return std::sqrt(squares / static_cast<double>(counted));
}

/// `error_per_s`: largest error over the period [rad/s]; `limit_ns`: shortest period at which the motion diverges.
template <class Make>
void step(benchmark::State& state, Make make, double error_per_s, std::int64_t limit_ns = longest_ns + 1) {
    const std::int64_t period_ns = state.range(0);
    const double period = 1e-9 * static_cast<double>(period_ns);
    const double error = motion_error(make(period), period_ns);
    const bool diverges = !std::isfinite(error);
    if (diverges != (period_ns >= limit_ns) || (!diverges && !(error <= error_per_s * period))) {
        state.SkipWithError(("error of the motion " + std::to_string(error) + " rad").c_str());
        return;
    }
    std::vector<double> force;
    for (double time = 0.0; time < duration_s; time += period) {
        force.push_back(hand(time));
    }
    auto structure = make(period);
    std::size_t k = 0;
    for (auto _ : state) {
        benchmark::DoNotOptimize(structure.drive(force[k]));
        if (++k == force.size()) {
            // The structure is reset, because numbers that are not finite would change the computing time
            k = 0;
            structure.reset(0.0);
        }
    }
    state.counters["period_s"] = period;
    state.counters["diverges"] = diverges ? 1.0 : 0.0;
    state.counters["motion_error_rad"] = diverges ? 0.0 : error;
}

void explicit_step(benchmark::State& state) {
    step(state, [](double T) { return palpate::Explicit{object(), inertia, none, T}; }, 1.0, 8'000'000);
}

void implicit_table(benchmark::State& state) {
    step(
        state,
        [](double T) {
            return palpate::Implicit{
                object(), inertia, none, T,
                palpate::Resolvent{object().curve().curve(), inertia.load_line_slope(T)}};
        },
        1.0);
}

void implicit_newton(benchmark::State& state) {
    step(
        state,
        [](double T) { return palpate::Implicit{object(), inertia, none, T, palpate::LoadLineSolver{}}; },
        1.0);
}

void energy_consistent(benchmark::State& state) {
    step(state, [](double T) { return palpate::EnergyConsistent{object(), inertia, none, T, 1e-4}; }, 1.0);
}

void periods(benchmark::internal::Benchmark* each) {
    for (std::int64_t period = shortest_ns; period <= longest_ns; period *= 2) {
        each->Arg(period);
    }
}

#define PALPATE_PRECISION(function) BENCHMARK(function)->Apply(periods)

PALPATE_PRECISION(explicit_step);
PALPATE_PRECISION(implicit_table);
PALPATE_PRECISION(implicit_newton);
PALPATE_PRECISION(energy_consistent);

}  // namespace

BENCHMARK_MAIN();
