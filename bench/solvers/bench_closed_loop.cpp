// SPDX-License-Identifier: Apache-2.0
// Measures the number of simulated ticks per second of computing time, with object, guards, device, hand and energy
// account, 20 integration substeps for each tick. A run fails if the sum of its energy account differs from zero by
// more than rounding.

#include <cmath>
#include <utility>

#include <benchmark/benchmark.h>

#include "../limits/hands.hpp"
#include "palpate/model/compiled_network.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/rendering/massless.hpp"
#include "palpate/simulation/closed_loop.hpp"
#include "scene.hpp"

namespace {

constexpr std::size_t ticks = 10'000;

template <class S, class H>
void closed_loop_of(benchmark::State& state, const S& structure, const H& hand) {
    const palpate::DeviceProfile device;
    for (auto _ : state) {
        const palpate::ClosedLoopEnd end = palpate::closed_loop(
            structure, device, hand, ticks, {static_cast<int>(state.range(0)), 0.2, 0.0, {}},
            [](const palpate::Tick&, const palpate::Motion&, const palpate::EnergyBalance&) { return true; });
        const double kinetic = 0.5 * device.inertia * end.handle.velocity * end.handle.velocity;
        const double imbalance = end.energy.hand - end.energy.motor - end.energy.dissipated - kinetic;
        if (!(std::abs(imbalance) <= 1e-12 * end.energy.throughput)) {
            state.SkipWithError("the energy account does not close");
            return;
        }
    }
    state.counters["ticks"] =
        benchmark::Counter(static_cast<double>(ticks), benchmark::Counter::kIsIterationInvariantRate);
}

palpate::CompiledNetwork object() {
    return palpate::CompiledNetwork{palpate::bench::spring_and_wall(16)};
}

void direct_sweeping(benchmark::State& state) {
    closed_loop_of(state, palpate::Direct{object()}, palpate::Hand{});
}

void direct_greedy(benchmark::State& state) {
    closed_loop_of(state, palpate::Direct{object()}, palpate::GreedyHand{10.0, 0.4, 0.02, 1.0});
}

void massless_heavy(benchmark::State& state) {
    closed_loop_of(state, palpate::Massless{object(), {50.0, 0.002}, 1e-3},
                   palpate::PassiveHand{0.0, 0.0, 1.0, 0.0});
}

}  // namespace

BENCHMARK(direct_sweeping)->ArgName("substeps")->Arg(4)->Arg(20);
BENCHMARK(direct_greedy)->ArgName("substeps")->Arg(4)->Arg(20);
BENCHMARK(massless_heavy)->ArgName("substeps")->Arg(4)->Arg(20);

BENCHMARK_MAIN();
