// SPDX-License-Identifier: Apache-2.0
// Measures one step of an admittance display, from the measured force to the position command, with each structure and
// solver. The force is that of the objects' curve along a slow motion, so each step of the object has a new position.
// Counters are the evaluations of the force a step, and the largest difference of the command from a reference, as a
// share of the travel: the same step with the sum of wavelets and a search with short steps. A difference above 1e-9 is
// a failure.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "palpate/device/device_profile.hpp"
#include "palpate/model/compiled_network.hpp"
#include "palpate/rendering/admittance.hpp"
#include "palpate/rendering/energy_consistent.hpp"
#include "palpate/rendering/explicit.hpp"
#include "palpate/rendering/implicit.hpp"
#include "palpate/solver/resolvent.hpp"
#include "solvers/scene.hpp"

namespace {

using palpate::Admittance;
using palpate::AnyStructure;
using palpate::CompiledNetwork;
using palpate::Inertia;
using palpate::LoadLineSolver;
using palpate::Resolvent;
using palpate::WaveletNetwork;

constexpr double period = 2.5e-4;
constexpr palpate::VirtualCoupling none{0.0, 0.0};
constexpr Inertia inertia{2e-3, 0.1};
constexpr double travel = 0.6;

WaveletNetwork spring_and_wall(std::size_t size) {
    return palpate::bench::spring_and_wall(size);
}
WaveletNetwork two_clicks(std::size_t size) {
    return palpate::bench::two_clicks(size);
}

/// Returns the force of a slow motion through the travel, with the damping of the object.
std::vector<double> forces(const WaveletNetwork& object) {
    std::vector<double> result;
    for (int k = 0; k < 8000; ++k) {
        const double phase = 2.0 * 3.14159265358979323846 * k / 8000.0;
        const double position = 0.5 * travel * (1.0 - 0.9 * std::cos(phase));
        result.push_back(object.at(position, {}).force);
    }
    return result;
}

/// Measures the time of a step of `object`, and compares its positions with those of `reference`.
void step(benchmark::State& state, const WaveletNetwork& network, const AnyStructure& object,
          const AnyStructure& reference) {
    palpate::DeviceProfile device;
    device.period_s = period;
    device.admittance = palpate::AdmittanceDisplay{};
    const std::vector<double> force = forces(network);
    Admittance source{object, device};
    Admittance exact{reference, device};
    std::size_t k = 0;
    for (auto _ : state) {
        benchmark::DoNotOptimize(source.step(force[k]));
        k = k + 1 == force.size() ? 0 : k + 1;
    }
    source.reset(0.0);
    exact.reset(0.0);
    double evaluations = 0.0;
    double largest = 0.0;
    for (const double f : force) {
        const palpate::PositionCommand command = source.step(f);
        largest = std::max(largest, std::abs(command.position - exact.step(f).position) / travel);
        evaluations += command.object.evaluations;
    }
    state.counters["evaluations"] = evaluations / static_cast<double>(force.size());
    state.counters["position_error"] = largest;
    if (!(largest <= 1e-9)) {
        state.SkipWithError(("differs by " + std::to_string(largest) + " of the travel").c_str());
    }
}

LoadLineSolver reference_solver() {
    LoadLineSolver solver;
    solver.longest_step = 0.002;
    solver.max_evaluations = 1000;
    return solver;
}

using Make = WaveletNetwork (*)(std::size_t);

template <Make make>
void explicit_step(benchmark::State& state) {
    const WaveletNetwork network = make(static_cast<std::size_t>(state.range(0)));
    step(state, network, palpate::Explicit{CompiledNetwork{network}, inertia, none, period},
         palpate::Explicit{network, inertia, none, period});
}

template <Make make>
void implicit_table(benchmark::State& state) {
    const WaveletNetwork network = make(static_cast<std::size_t>(state.range(0)));
    const double p = inertia.load_line_slope(period);
    step(state, network,
         palpate::Implicit{CompiledNetwork{network}, inertia, none, period, Resolvent{network.curve(), p}},
         palpate::Implicit{network, inertia, none, period, reference_solver()});
}

template <Make make>
void implicit_newton(benchmark::State& state) {
    const WaveletNetwork network = make(static_cast<std::size_t>(state.range(0)));
    step(state, network, palpate::Implicit{CompiledNetwork{network}, inertia, none, period, LoadLineSolver{}},
         palpate::Implicit{network, inertia, none, period, reference_solver()});
}

template <Make make>
void energy_consistent(benchmark::State& state) {
    const WaveletNetwork network = make(static_cast<std::size_t>(state.range(0)));
    const auto over = [](const auto& environment) {
        return palpate::EnergyConsistent{environment, inertia, none, period, 1e-4};
    };
    step(state, network, over(CompiledNetwork{network}), over(network));
}

#define PALPATE_ADMITTANCE(function)                        \
    BENCHMARK(function<spring_and_wall>)->Arg(16)->Arg(64); \
    BENCHMARK(function<two_clicks>)->Arg(16)->Arg(64)

PALPATE_ADMITTANCE(explicit_step);
PALPATE_ADMITTANCE(implicit_table);
PALPATE_ADMITTANCE(implicit_newton);
PALPATE_ADMITTANCE(energy_consistent);

}  // namespace

BENCHMARK_MAIN();
