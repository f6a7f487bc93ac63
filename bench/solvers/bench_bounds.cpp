// SPDX-License-Identifier: Apache-2.0
// Measures the time of a proved slope bound and its excess over a dense search, for networks of one and two inputs.
// Some networks have weights of a million that cancel.

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "palpate/model/bounds.hpp"
#include "palpate/model/network_curve.hpp"
#include "palpate/model/radial_network.hpp"

namespace {

using palpate::Interval;
using palpate::NetworkParameters;

NetworkParameters random_network(std::size_t size, std::size_t dimension, double finest) {
    std::mt19937_64 random{7};
    const auto uniform = [&](double low, double high) {
        return std::uniform_real_distribution<double>{low, high}(random);
    };
    NetworkParameters network;
    network.dimension = dimension;
    network.linear.assign(dimension, 2.0);
    for (std::size_t k = 0; k < size * dimension; ++k) {
        network.alpha.push_back(std::exp(uniform(0.0, std::log(finest))));
        network.beta.push_back(uniform(-0.1, 1.1));
    }
    for (std::size_t k = 0; k < size; ++k) {
        network.weight.push_back(uniform(-1.0, 1.0));
    }
    return network;
}

/// Measures one network; fails if the proved bound is smaller than the searched slope, or exceeds it by more than
/// `allowed` times the largest slope.
void assert_tight(benchmark::State& state, Interval proved, Interval sampled, double allowed) {
    const double excess =
        std::max(proved.upper - sampled.upper, sampled.lower - proved.lower) / sampled.largest();
    state.counters["excess"] = excess;
    if (!(proved.upper >= sampled.upper && proved.lower <= sampled.lower)) {
        state.SkipWithError("violated");
    } else if (!(excess <= allowed)) {
        state.SkipWithError(("too wide by " + std::to_string(excess)).c_str());
    }
}

void bound(benchmark::State& state, const NetworkParameters& network) {
    for (auto _ : state) {
        benchmark::DoNotOptimize(palpate::slope_bounds(network, 0.0, 1.0));
    }
    Interval sampled{INFINITY, -INFINITY};
    const palpate::NetworkCurve curve{network, {}};
    for (int k = 0; k <= 100'000; ++k) {
        const double slope = curve.inside(k / 100'000.0).slope;
        sampled = sampled.with({slope, slope});
    }
    assert_tight(state, palpate::slope_bounds(network, 0.0, 1.0), sampled, 0.0101);
}

void slope_bound(benchmark::State& state) {
    bound(state, random_network(static_cast<std::size_t>(state.range(0)), 1, 50.0));
}

/// Returns the network, changed so that every second wavelet cancels the one before it except for a millionth.
NetworkParameters cancelling(NetworkParameters network) {
    const std::size_t d = network.dimension;
    for (std::size_t i = 0; i + 1 < network.weight.size(); i += 2) {
        for (std::size_t j = 0; j < d; ++j) {
            network.alpha[(i + 1) * d + j] = network.alpha[i * d + j] * (1.0 + 1e-6);
            network.beta[(i + 1) * d + j] = network.beta[i * d + j];
        }
        network.weight[i] *= 1e6;
        network.weight[i + 1] = -network.weight[i];
    }
    return network;
}

void slope_bound_cancelling(benchmark::State& state) {
    bound(state, cancelling(random_network(static_cast<std::size_t>(state.range(0)), 1, 50.0)));
}

void gradient_bound(benchmark::State& state, const NetworkParameters& parameters) {
    const std::vector<double> lower{0.0, 0.0};
    const std::vector<double> upper{1.0, 1.0};
    for (auto _ : state) {
        benchmark::DoNotOptimize(palpate::radial_bounds(parameters, lower, upper));
    }
    const palpate::RadialSum network{parameters, lower, upper};
    Interval sampled{INFINITY, -INFINITY};
    for (int i = 0; i <= 400; ++i) {
        for (int j = 0; j <= 400; ++j) {
            const std::vector<double> x{i / 400.0, j / 400.0};
            double value = 0.0;
            std::vector<double> gradient = parameters.linear;
            network.add(x.data(), value, gradient.data());
            sampled = sampled.with({gradient[0], gradient[0]});
        }
    }
    assert_tight(state, palpate::radial_bounds(parameters, lower, upper).gradient[0], sampled, 0.012);
}

void gradient_bound_two_inputs(benchmark::State& state) {
    gradient_bound(state, random_network(static_cast<std::size_t>(state.range(0)), 2, 15.0));
}

void gradient_bound_two_inputs_cancelling(benchmark::State& state) {
    gradient_bound(state, cancelling(random_network(static_cast<std::size_t>(state.range(0)), 2, 15.0)));
}

}  // namespace

BENCHMARK(slope_bound)->ArgName("wavelets")->RangeMultiplier(2)->Range(8, 128)->Unit(benchmark::kMicrosecond);
BENCHMARK(slope_bound_cancelling)->ArgName("wavelets")->Arg(16)->Arg(64)->Unit(benchmark::kMicrosecond);
BENCHMARK(gradient_bound_two_inputs)
    ->ArgName("wavelets")
    ->RangeMultiplier(2)
    ->Range(8, 64)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(gradient_bound_two_inputs_cancelling)
    ->ArgName("wavelets")
    ->Arg(16)
    ->Arg(64)
    ->Unit(benchmark::kMicrosecond);

BENCHMARK_MAIN();
