// SPDX-License-Identifier: Apache-2.0
// Measures time and error of every integration method with periods from 4 ms to 1/16 ms. A mass behind the coupling
// follows the motion of a hand. The exact motion is the solution of
// m y'' = K_c (x - y) + B_c (x' - y') - f(y) - B_o y' by Runge-Kutta steps of 1/1024 ms. A method must diverge exactly
// beyond its stability limit.

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
#include "palpate/solver/resolvent.hpp"
#include "scene.hpp"
#include "time_steps.hpp"

namespace {

using palpate::CompiledNetwork;

constexpr palpate::VirtualCoupling coupling{100.0, 0.02};
constexpr palpate::Inertia inertia{0.001, 0.5};
constexpr double duration_s = 2.0;
constexpr double settled_s = 0.2;  // motion errors count from this time, after the initial transient
constexpr std::int64_t longest_ns = 4'000'000;
constexpr std::int64_t shortest_ns = 62'500;
constexpr int truth_steps = 64;  // integration steps of the exact motion in shortest_ns

const CompiledNetwork& object() {
    static const CompiledNetwork compiled{palpate::bench::spring_and_wall(16)};
    return compiled;
}

/// Position and velocity of a hand that presses through the whole object with a small oscillation.
struct Motion {
    double position;
    double velocity;
};

Motion hand(double time) {
    constexpr double slow = 2.0 * std::numbers::pi * 0.5;
    constexpr double fast = 2.0 * std::numbers::pi * 7.0;
    return {0.25 - 0.22 * std::cos(slow * time) + 0.01 * (1.0 - std::cos(fast * time)),
            0.22 * slow * std::sin(slow * time) + 0.01 * fast * std::sin(fast * time)};
}

/// Exact position y of the virtual object at every multiple of shortest_ns.
const std::vector<double>& reference_positions() {
    static const std::vector<double> solution = [] {
        const auto acceleration = [](double time, double y, double v) {
            const Motion device = hand(time);
            return (coupling.force(device.position - y, device.velocity - v) - object().at(y, {}).force -
                    inertia.damping * v) /
                   inertia.mass;
        };
        constexpr double h = 1e-9 * shortest_ns / truth_steps;
        const auto samples = static_cast<std::size_t>(std::llround(1e9 * duration_s / shortest_ns));
        double y = hand(0.0).position;
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

/// Returns the RMS of simulated minus exact object position from settled_s on; infinity if the motion diverges.
template <class S>
double motion_error(S structure, std::int64_t period_ns) {
    const auto stride = static_cast<std::size_t>(period_ns / shortest_ns);
    structure.reset(hand(0.0).position);
    double squares = 0.0;
    std::size_t counted = 0;
    for (std::size_t k = stride; k < reference_positions().size(); k += stride) {
        const double time = 1e-9 * shortest_ns * static_cast<double>(k);
        const palpate::Rendered rendered = structure.step(hand(time).position);
        const double error = rendered.environment_position - reference_positions()[k];
        if (rendered.status != palpate::Status::Ok || !(std::abs(error) < 1.0)) {
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

    std::vector<double> motion;
    for (double time = 0.0; time < duration_s; time += period) {
        motion.push_back(hand(time).position);
    }
    auto structure = make(period);
    structure.reset(motion.front());
    std::size_t k = 0;
    for (auto _ : state) {
        benchmark::DoNotOptimize(structure.step(motion[k]));
        if (++k == motion.size()) {
            // The structure is reset, because very large or not finite positions would slow down the computation.
            k = 0;
            structure.reset(motion.front());
        }
    }
    state.counters["period_s"] = period;
    state.counters["diverges"] = diverges ? 1.0 : 0.0;
    state.counters["motion_error_rad"] = diverges ? 0.0 : error;
}

// With B_o = 0.5 and m = 0.001 the explicit limit (4m - 2 (B_o + B_c) T)/T^2 falls below the slopes of object
// and coupling between 2 ms and 4 ms; four substeps move it beyond 4 ms.
void explicit_euler(benchmark::State& state) {
    step(state, [](double T) { return palpate::Explicit{object(), inertia, coupling, T}; }, 0.03, 4'000'000);
}

void substepped_explicit(benchmark::State& state) {
    step(
        state, [](double T) { return palpate::bench::Substepped{object(), inertia, coupling, T, 4}; }, 0.012);
}

void linearly_implicit(benchmark::State& state) {
    step(
        state,
        [](double T) {
            return palpate::Implicit{object(), inertia, coupling, T, palpate::bench::OneNewtonStep{}};
        },
        0.03);
}

void implicit_newton(benchmark::State& state) {
    step(state, [](double T) { return palpate::Implicit{object(), inertia, coupling, T}; }, 0.03);
}

void implicit_table(benchmark::State& state) {
    step(
        state,
        [](double T) {
            const double p = palpate::Implicit<CompiledNetwork>::load_line_slope(inertia, coupling, T);
            return palpate::Implicit{object(), inertia, coupling, T,
                                     palpate::Resolvent{palpate::bench::spring_and_wall(16).curve(), p}};
        },
        0.03);
}

void trapezoidal(benchmark::State& state) {
    step(state, [](double T) { return palpate::bench::Trapezoidal{object(), inertia, coupling, T}; }, 0.002);
}

void energy_consistent(benchmark::State& state) {
    step(state, [](double T) { return palpate::EnergyConsistent{object(), inertia, coupling, T}; }, 0.03);
}

void periods(benchmark::internal::Benchmark* benchmark) {
    benchmark->ArgName("period_ns");
    for (std::int64_t period = longest_ns; period >= shortest_ns; period /= 2) {
        benchmark->Arg(period);
    }
}

}  // namespace

BENCHMARK(explicit_euler)->Apply(periods);
BENCHMARK(substepped_explicit)->Apply(periods);
BENCHMARK(linearly_implicit)->Apply(periods);
BENCHMARK(implicit_newton)->Apply(periods);
BENCHMARK(implicit_table)->Apply(periods);
BENCHMARK(trapezoidal)->Apply(periods);
BENCHMARK(energy_consistent)->Apply(periods);

BENCHMARK_MAIN();
