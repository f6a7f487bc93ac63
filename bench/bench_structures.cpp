// SPDX-License-Identifier: Apache-2.0
// One tick of every structure along a hand's motion, state carried from tick to tick: explicit against
// implicit. Beside the time stand the error of the rendered force against f at the handle and the evaluations
// a tick.

#include <cmath>
#include <string>

#include <benchmark/benchmark.h>

#include "palpate/model/compiled_network.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/rendering/energy_consistent.hpp"
#include "palpate/rendering/explicit.hpp"
#include "palpate/rendering/implicit.hpp"
#include "palpate/rendering/massless.hpp"
#include "palpate/rendering/substepped.hpp"
#include "palpate/rendering/trapezoidal.hpp"
#include "palpate/solver/one_newton_step.hpp"
#include "palpate/solver/resolvent.hpp"
#include "scene.hpp"

namespace {

constexpr double period = 1e-3;
constexpr palpate::VirtualCoupling coupling{100.0, 0.02};
constexpr palpate::Inertia inertia{0.001, 0.5};

/// `allowed_error` is what the coupling and the damping of the structure leave; more means a wrong solver.
template <class S>
void tick(benchmark::State& state, const S& initial, double allowed_error) {
    const palpate::WaveletNetwork object =
        palpate::bench::spring_and_wall(static_cast<std::size_t>(state.range(0)));
    const std::vector<double> motion = palpate::bench::hand_motion(4000);
    S structure = initial;
    structure.reset(motion.front());
    std::size_t k = 0;
    for (auto _ : state) {
        benchmark::DoNotOptimize(structure.step(motion[k]));
        k = k + 1 == motion.size() ? 0 : k + 1;
    }

    structure.reset(motion.front());
    double squares = 0.0;
    double evaluations = 0.0;
    for (const double x : motion) {
        const palpate::Rendered rendered = structure.step(x);
        if (rendered.status != palpate::Status::Ok) {
            state.SkipWithError(palpate::text(rendered.status).word);
            return;
        }
        squares += std::pow(rendered.force - object.at(x, {}).force, 2);
        evaluations += rendered.evaluations;
    }
    const double rms = std::sqrt(squares / static_cast<double>(motion.size()));
    state.counters["force_error_rms"] = rms;
    state.counters["evaluations"] = evaluations / static_cast<double>(motion.size());
    if (!(rms <= allowed_error)) {
        state.SkipWithError(("force error " + std::to_string(rms)).c_str());
    }
}

void direct(benchmark::State& state) {
    const auto object = palpate::bench::spring_and_wall(static_cast<std::size_t>(state.range(0)));
    tick(state, palpate::Direct{object}, 1e-12);
}

void explicit_euler(benchmark::State& state) {
    const auto object = palpate::bench::spring_and_wall(static_cast<std::size_t>(state.range(0)));
    tick(state, palpate::Explicit{object, inertia, coupling, period}, 1.5);
}

void implicit_newton(benchmark::State& state) {
    const auto object = palpate::bench::spring_and_wall(static_cast<std::size_t>(state.range(0)));
    tick(state, palpate::Implicit{object, inertia, coupling, period}, 1.5);
}

void massless_newton(benchmark::State& state) {
    const auto object = palpate::bench::spring_and_wall(static_cast<std::size_t>(state.range(0)));
    tick(state, palpate::Massless{object, coupling, period}, 1.5);
}

/// The table in place of the sum, the resolvent in place of the search.
void explicit_compiled(benchmark::State& state) {
    const auto object = palpate::bench::spring_and_wall(static_cast<std::size_t>(state.range(0)));
    tick(state, palpate::Explicit{palpate::CompiledNetwork{object}, inertia, coupling, period}, 1.5);
}

void implicit_resolvent(benchmark::State& state) {
    const auto object = palpate::bench::spring_and_wall(static_cast<std::size_t>(state.range(0)));
    const double p = palpate::Implicit<palpate::CompiledNetwork>::load_line_slope(inertia, coupling, period);
    tick(state,
         palpate::Implicit{palpate::CompiledNetwork{object}, inertia, coupling, period,
                           palpate::Resolvent{object.curve(), p}},
         1.5);
}

void massless_resolvent(benchmark::State& state) {
    const auto object = palpate::bench::spring_and_wall(static_cast<std::size_t>(state.range(0)));
    const double p = palpate::Massless<palpate::CompiledNetwork>::load_line_slope(coupling, period);
    tick(state,
         palpate::Massless{palpate::CompiledNetwork{object}, coupling, period,
                           palpate::Resolvent{object.curve(), p}},
         1.5);
}

/// Newton's method with the predictor and the certified stop.
void implicit_certified(benchmark::State& state) {
    const auto object = palpate::bench::spring_and_wall(static_cast<std::size_t>(state.range(0)));
    tick(state,
         palpate::Implicit{palpate::CompiledNetwork{object}, inertia, coupling, period,
                           palpate::certified_solver(palpate::piecewise(object.curve()))},
         1.5);
}

/// The same, over the sum of wavelets itself.
void implicit_certified_network(benchmark::State& state) {
    const auto object = palpate::bench::spring_and_wall(static_cast<std::size_t>(state.range(0)));
    tick(state,
         palpate::Implicit{object, inertia, coupling, period,
                           palpate::certified_solver(palpate::piecewise(object.curve()))},
         1.5);
}

void linearly_implicit(benchmark::State& state) {
    const palpate::CompiledNetwork object{
        palpate::bench::spring_and_wall(static_cast<std::size_t>(state.range(0)))};
    tick(state, palpate::Implicit{object, inertia, coupling, period, palpate::OneNewtonStep{}}, 1.5);
}

void trapezoidal(benchmark::State& state) {
    const palpate::CompiledNetwork object{
        palpate::bench::spring_and_wall(static_cast<std::size_t>(state.range(0)))};
    tick(state, palpate::Trapezoidal{object, inertia, coupling, period}, 1.5);
}

void energy_consistent(benchmark::State& state) {
    const palpate::CompiledNetwork object{
        palpate::bench::spring_and_wall(static_cast<std::size_t>(state.range(0)))};
    tick(state, palpate::EnergyConsistent{object, inertia, coupling, period}, 1.5);
}

void substepped(benchmark::State& state) {
    const palpate::CompiledNetwork object{
        palpate::bench::spring_and_wall(static_cast<std::size_t>(state.range(0)))};
    tick(state, palpate::Substepped{object, inertia, coupling, period, 4}, 1.5);
}

}  // namespace

BENCHMARK(explicit_compiled)->ArgName("wavelets")->Arg(16)->Arg(64);
BENCHMARK(implicit_resolvent)->ArgName("wavelets")->Arg(16)->Arg(64);
BENCHMARK(implicit_certified)->ArgName("wavelets")->Arg(16)->Arg(64);
BENCHMARK(implicit_certified_network)->ArgName("wavelets")->Arg(16)->Arg(64);
BENCHMARK(massless_resolvent)->ArgName("wavelets")->Arg(16)->Arg(64);
BENCHMARK(linearly_implicit)->ArgName("wavelets")->Arg(16)->Arg(64);
BENCHMARK(trapezoidal)->ArgName("wavelets")->Arg(16)->Arg(64);
BENCHMARK(energy_consistent)->ArgName("wavelets")->Arg(16)->Arg(64);
BENCHMARK(substepped)->ArgName("wavelets")->Arg(16)->Arg(64);
BENCHMARK(direct)->ArgName("wavelets")->Arg(8)->Arg(16)->Arg(64);
BENCHMARK(explicit_euler)->ArgName("wavelets")->Arg(8)->Arg(16)->Arg(64);
BENCHMARK(implicit_newton)->ArgName("wavelets")->Arg(8)->Arg(16)->Arg(64);
BENCHMARK(massless_newton)->ArgName("wavelets")->Arg(8)->Arg(16)->Arg(64);

BENCHMARK_MAIN();
