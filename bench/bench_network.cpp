// SPDX-License-Identifier: Apache-2.0
// Cost of one evaluation (value, slope and energy) on a dependent chain, as a solver asks for it.

#include <cmath>
#include <string>

#include <benchmark/benchmark.h>

#include "palpate/model/network.hpp"
#include "scene.hpp"

namespace {

void evaluate(benchmark::State& state) {
    const auto size = static_cast<std::size_t>(state.range(0));
    const palpate::WaveletNetwork network = palpate::bench::spring_and_wall(size);
    double x = 0.1;
    double deviation = 0.0;
    for (auto _ : state) {
        const palpate::EnvironmentSample sample = network.at(x, {});
        benchmark::DoNotOptimize(sample);
        x = 0.3 + 0.2 * std::fmod(sample.force, 1.0);
    }
    // The answer, against a plain sum.
    for (double at = 0.0; at <= 0.6; at += 0.01) {
        const palpate::NetworkParameters& p = network.parameters();
        double sum = p.linear[0] * at + p.bias;
        for (std::size_t i = 0; i < size; ++i) {
            const double u = p.alpha[i] * (at - p.beta[i]);
            sum += p.weight[i] * (u * u - 1.0) * std::exp(-0.5 * u * u);
        }
        deviation = std::max(deviation, std::abs(network.at(at, {}).force - sum));
    }
    if (deviation > 1e-12) {
        state.SkipWithError(("wrong by " + std::to_string(deviation)).c_str());
    }
    state.counters["max_error"] = deviation;
}

}  // namespace

BENCHMARK(evaluate)->ArgName("wavelets")->RangeMultiplier(2)->Range(8, 128);

BENCHMARK_MAIN();
