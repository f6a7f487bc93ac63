// SPDX-License-Identifier: Apache-2.0
// Measures value and slope of a network: time of one evaluation on a dependent chain, as in a solver, and time of a
// sample in a batch. References: the plain loop over std::exp, a lookup table with linear interpolation and a cubic
// spline, both with 4096 cells. Every line shows its largest error.

#include <cmath>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "palpate/model/compiled_network.hpp"
#include "palpate/model/network.hpp"
#include "palpate/model/radial_network.hpp"
#include "scene.hpp"

namespace {

using palpate::NetworkParameters;

struct Answer {
    double value, slope;
};

/// The plain loop.
struct ExpLoop {
    static constexpr double largest_error = 1e-12;  ///< largest allowed error of the model force
    NetworkParameters p;

    explicit ExpLoop(const palpate::WaveletNetwork& network) : p{network.parameters()} {}

    Answer operator()(double x) const {
        Answer sum{p.linear[0] * x + p.bias, p.linear[0]};
        for (std::size_t i = 0; i < p.weight.size(); ++i) {
            const double u = p.alpha[i] * (x - p.beta[i]);
            const double gaussian = p.weight[i] * std::exp(-0.5 * u * u);
            sum.value += (u * u - 1.0) * gaussian;
            sum.slope += p.alpha[i] * (3.0 - u * u) * u * gaussian;
        }
        return sum;
    }
};

struct Network {
    static constexpr double largest_error = 1e-12;  ///< largest allowed error of the model force
    palpate::WaveletNetwork network;

    explicit Network(const palpate::WaveletNetwork& given) : network{given} {}

    Answer operator()(double x) const {
        const palpate::EnvironmentSample sample = network.at(x, {});
        return {sample.force, sample.slope};
    }
};

struct Compiled {
    static constexpr double largest_error = 1e-11;  ///< largest allowed error of the model force
    palpate::CompiledNetwork network;

    explicit Compiled(const palpate::WaveletNetwork& given) : network{given} {}

    Answer operator()(double x) const {
        const palpate::EnvironmentSample sample = network.at(x, {});
        return {sample.force, sample.slope};
    }
};

constexpr std::size_t cells = 4096;

/// Model force and slope at the borders of equally wide position cells of [0, 0.6].
struct Nodes {
    std::vector<Answer> at;
    double width = 0.6 / static_cast<double>(cells);

    explicit Nodes(const palpate::WaveletNetwork& network) {
        for (std::size_t k = 0; k <= cells; ++k) {
            const palpate::EnvironmentSample sample = network.at(width * static_cast<double>(k), {});
            at.push_back({sample.force, sample.slope});
        }
    }
};

struct Table : Nodes {
    static constexpr double largest_error = 1e-4;  ///< largest allowed error of the model force
    using Nodes::Nodes;

    Answer operator()(double x) const {
        const double z = x / width;
        const auto k = std::min(static_cast<std::size_t>(z), cells - 1);
        const double rise = at[k + 1].value - at[k].value;
        return {at[k].value + (z - static_cast<double>(k)) * rise, rise / width};
    }
};

struct CubicSpline : Nodes {
    static constexpr double largest_error = 1e-8;  ///< largest allowed error of the model force
    using Nodes::Nodes;

    Answer operator()(double x) const {
        const double z = x / width;
        const auto k = std::min(static_cast<std::size_t>(z), cells - 1);
        const double t = z - static_cast<double>(k);
        const double from = width * at[k].slope;
        const double to = width * at[k + 1].slope;
        const double rise = at[k + 1].value - at[k].value;
        const double c2 = 3.0 * rise - 2.0 * from - to;
        const double c3 = from + to - 2.0 * rise;
        return {at[k].value + t * (from + t * (c2 + t * c3)), (from + t * (2.0 * c2 + 3.0 * t * c3)) / width};
    }
};

/// Checks the largest deviation of a method from the loop over std::exp; the benchmark fails if the deviation exceeds
/// the error that the method promises.
template <class Method>
void assert_answer(benchmark::State& state, const palpate::WaveletNetwork& network, const Method& method) {
    const ExpLoop exact{network};
    double error = 0.0;
    for (int k = 0; k <= 6000; ++k) {
        const double x = 1e-4 * k;
        error = std::max(error, std::abs(method(x).value - exact(x).value));
    }
    state.counters["max_error"] = error;
    if (!(error <= Method::largest_error)) {
        state.SkipWithError(("wrong by " + std::to_string(error)).c_str());
    }
}

template <class Method>
void latency(benchmark::State& state) {
    const auto network = palpate::bench::spring_and_wall(static_cast<std::size_t>(state.range(0)));
    const Method method{network};
    double x = 0.1;
    for (auto _ : state) {
        const Answer answer = method(x);
        x = 0.3 + 0.01 * (answer.value + 1e-9 * answer.slope);
    }
    benchmark::DoNotOptimize(x);  // after the loop: inside it, x would be stored in memory at every step
    assert_answer(state, network, method);
}

template <class Method>
void throughput(benchmark::State& state) {
    const auto network = palpate::bench::spring_and_wall(static_cast<std::size_t>(state.range(0)));
    const Method method{network};
    const std::vector<double> motion = palpate::bench::hand_motion(4000);
    std::vector<double> force(motion.size());
    for (auto _ : state) {
        for (std::size_t k = 0; k < motion.size(); ++k) {
            force[k] = method(motion[k]).value;
        }
        benchmark::DoNotOptimize(force.data());
        benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * motion.size()));
    assert_answer(state, network, method);
}

/// Measures the time of one call that computes the forces at many positions, as Python does for arrays.
void throughput_batch(benchmark::State& state) {
    const auto network = palpate::bench::spring_and_wall(static_cast<std::size_t>(state.range(0)));
    const std::vector<double> motion = palpate::bench::hand_motion(4000);
    std::vector<double> force(motion.size());
    for (auto _ : state) {
        network.curve().at(palpate::HatQuantity::Force, motion, force);
        benchmark::DoNotOptimize(force.data());
        benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * motion.size()));
    const ExpLoop exact{network};
    double error = 0.0;
    for (std::size_t k = 0; k < motion.size(); ++k) {
        error = std::max(error, std::abs(force[k] - exact(motion[k]).value));
    }
    state.counters["max_error"] = error;
    if (!(error <= 1e-12)) {
        state.SkipWithError(("wrong by " + std::to_string(error)).c_str());
    }
}

/// Computes force and gradient of a wavelet network of several inputs.
struct Radial {
    palpate::RadialNetwork network;

    double operator()(const std::vector<double>& x, std::vector<double>& gradient) const {
        return network.at(x, gradient);
    }
};

struct RadialExpLoop {
    palpate::RadialNetwork network;

    double operator()(const std::vector<double>& x, std::vector<double>& gradient) const {
        const NetworkParameters& p = network.parameters();
        const std::size_t d = p.dimension;
        double sum = p.bias;
        for (std::size_t j = 0; j < d; ++j) {
            sum += p.linear[j] * x[j];
            gradient[j] = p.linear[j];
        }
        for (std::size_t i = 0; i < p.weight.size(); ++i) {
            double square = 0.0;
            for (std::size_t j = 0; j < d; ++j) {
                const double u = p.alpha[i * d + j] * (x[j] - p.beta[i * d + j]);
                square += u * u;
            }
            const double gaussian = p.weight[i] * std::exp(-0.5 * square);
            const auto inputs = static_cast<double>(d);
            sum += (square - inputs) * gaussian;
            for (std::size_t j = 0; j < d; ++j) {
                const double alpha = p.alpha[i * d + j];
                gradient[j] +=
                    (inputs + 2.0 - square) * gaussian * alpha * alpha * (x[j] - p.beta[i * d + j]);
            }
        }
        return sum;
    }
};

template <class Method>
void latency_of_inputs(benchmark::State& state) {
    const auto network = palpate::bench::several_inputs(static_cast<std::size_t>(state.range(0)),
                                                        static_cast<std::size_t>(state.range(1)));
    const Method method{network};
    std::vector<double> x(network.dimension(), 0.4);
    std::vector<double> gradient(network.dimension());
    for (auto _ : state) {
        x[0] = 0.4 + 1e-3 * method(x, gradient);
    }
    benchmark::DoNotOptimize(x);
    const RadialExpLoop exact{network};
    double error = 0.0;
    for (int k = 0; k <= 1000; ++k) {
        x[0] = 1e-3 * k;
        error = std::max(error, std::abs(method(x, gradient) - exact(x, gradient)));
    }
    state.counters["max_error"] = error;
    if (!(error <= 1e-12)) {
        state.SkipWithError(("wrong by " + std::to_string(error)).c_str());
    }
}

/// Measures the time to build the force table of a model and to prove the error of the table.
void compile(benchmark::State& state) {
    const auto network = palpate::bench::spring_and_wall(static_cast<std::size_t>(state.range(0)));
    for (auto _ : state) {
        palpate::CompiledNetwork compiled{network};
        benchmark::DoNotOptimize(compiled);
    }
    const palpate::CompiledNetwork compiled{network};
    state.counters["cells"] = static_cast<double>(compiled.curve().cells());
    state.counters["certified_error"] = compiled.curve().value_error();
    if (!compiled.curve().compiled()) {
        state.SkipWithError("not compiled");
    }
}

void sizes(benchmark::internal::Benchmark* benchmark) {
    benchmark->ArgName("wavelets")->RangeMultiplier(2)->Range(8, 128);
}

void sizes_and_inputs(benchmark::internal::Benchmark* benchmark) {
    benchmark->ArgNames({"wavelets", "inputs"})->ArgsProduct({{16, 64}, {2, 3}});
}

}  // namespace

BENCHMARK_TEMPLATE(latency, ExpLoop)->Apply(sizes);
BENCHMARK_TEMPLATE(latency, Network)->Apply(sizes);
BENCHMARK_TEMPLATE(latency, Compiled)->Apply(sizes);
BENCHMARK_TEMPLATE(latency, Table)->Apply(sizes);
BENCHMARK_TEMPLATE(latency, CubicSpline)->Apply(sizes);
BENCHMARK_TEMPLATE(throughput, ExpLoop)->Apply(sizes);
BENCHMARK_TEMPLATE(throughput, Network)->Apply(sizes);
BENCHMARK(throughput_batch)->Apply(sizes);
BENCHMARK_TEMPLATE(throughput, Compiled)->Apply(sizes);
BENCHMARK_TEMPLATE(throughput, Table)->Apply(sizes);
BENCHMARK_TEMPLATE(throughput, CubicSpline)->Apply(sizes);
BENCHMARK_TEMPLATE(latency_of_inputs, RadialExpLoop)->Apply(sizes_and_inputs);
BENCHMARK_TEMPLATE(latency_of_inputs, Radial)->Apply(sizes_and_inputs);
BENCHMARK(compile)->Apply(sizes);

BENCHMARK_MAIN();
