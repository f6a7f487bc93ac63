// SPDX-License-Identifier: Apache-2.0
// Measures one step of every structure along the motion of a hand, with the state of the previous step. The objects are
// a spring with a wall and two clicks that snap through with a soft coupling. Counters are the error of the rendered
// force against f at the handle, the evaluations a step, and the position error against a search over the network.
// A position error above 1e-12 of the travel is a failure.

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "palpate/model/compiled_network.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/rendering/energy_consistent.hpp"
#include "palpate/rendering/explicit.hpp"
#include "palpate/rendering/implicit.hpp"
#include "palpate/rendering/massless.hpp"
#include "palpate/solver/resolvent.hpp"
#include "scene.hpp"
#include "time_steps.hpp"

namespace {

using palpate::CertifiedSolver;
using palpate::CompiledNetwork;
using palpate::Inertia;
using palpate::LoadLineSolver;
using palpate::Resolvent;
using palpate::VirtualCoupling;
using palpate::WaveletNetwork;

constexpr double period = 1e-3;

/// Object with a coupling and an inertia. In the scene with two clicks only the step of the explicit structure has
/// exactly one solution.
struct SpringWall {
    static constexpr VirtualCoupling coupling{100.0, 0.02};
    static constexpr Inertia inertia{0.001, 0.5};
    static WaveletNetwork object(std::size_t size) { return palpate::bench::spring_and_wall(size); }
};
struct SnapThrough {
    static constexpr VirtualCoupling coupling{10.0, 0.001};
    static constexpr Inertia inertia{2e-6, 1e-3};
    static WaveletNetwork object(std::size_t size) { return palpate::bench::two_clicks(size); }
};

std::size_t size_of(const benchmark::State& state) {
    return static_cast<std::size_t>(state.range(0));
}

/// Measures the time of a step of the structure `initial`, and compares its forces with those of `reference`.
template <class S, class R>
void step(benchmark::State& state, const WaveletNetwork& object, const S& initial, R reference,
          double allowed_error) {
    const std::vector<double> motion = palpate::bench::hand_motion(4000);
    S structure = initial;
    structure.reset(motion.front());
    std::size_t k = 0;
    for (auto _ : state) {
        benchmark::DoNotOptimize(structure.step(motion[k]));
        k = k + 1 == motion.size() ? 0 : k + 1;
    }

    structure.reset(motion.front());
    reference.reset(motion.front());
    double squares = 0.0;
    double evaluations = 0.0;
    double largest_difference = 0.0;
    for (const double x : motion) {
        const palpate::Rendered rendered = structure.step(x);
        const palpate::Rendered expected = reference.step(x);
        if (rendered.status != palpate::Status::Ok) {
            state.SkipWithError(palpate::text(rendered.status).word);
            return;
        }
        squares += std::pow(rendered.force - object.at(x, {}).force, 2);
        evaluations += rendered.evaluations;
        largest_difference =
            std::max(largest_difference,
                     std::abs(rendered.environment_position - expected.environment_position) / 0.6);
    }
    state.counters["force_error_rms"] = std::sqrt(squares / static_cast<double>(motion.size()));
    state.counters["evaluations"] = evaluations / static_cast<double>(motion.size());
    state.counters["position_error"] = largest_difference;
    if (!(largest_difference <= allowed_error)) {
        state.SkipWithError(("differs by " + std::to_string(largest_difference) + " of the travel").c_str());
    }
}

/// Load-line solver that evaluates the sum of wavelets, with search steps short enough to find every solution.
LoadLineSolver reference_solver() {
    LoadLineSolver solver;
    solver.longest_step = 0.002;
    solver.max_evaluations = 1000;
    return solver;
}

constexpr double exactly = 1e-12;  ///< of the travel

template <class Scene>
double implicit_slope() {
    return palpate::Implicit<CompiledNetwork>::load_line_slope(Scene::inertia, Scene::coupling, period);
}

template <class Scene>
double massless_slope() {
    return palpate::Massless<CompiledNetwork>::load_line_slope(Scene::coupling, period);
}

template <class Scene, class E, class Solver>
void implicit(benchmark::State& state, const WaveletNetwork& object, const E& environment,
              const Solver& solver) {
    step(state, object, palpate::Implicit{environment, Scene::inertia, Scene::coupling, period, solver},
         palpate::Implicit{object, Scene::inertia, Scene::coupling, period, reference_solver()}, exactly);
}

template <class Scene, class Solver>
void massless(benchmark::State& state, const WaveletNetwork& object, const Solver& solver) {
    step(state, object, palpate::Massless{CompiledNetwork{object}, Scene::coupling, period, solver},
         palpate::Massless{object, Scene::coupling, period, reference_solver()}, exactly);
}

/// The reference is a step of the explicit structure with the same table of the force f.
template <class Scene>
void explicit_step(benchmark::State& state) {
    const WaveletNetwork object = Scene::object(size_of(state));
    // With the inertia of the spring and wall the explicit step is stable for every object of this file.
    const auto over = [&](const auto& environment) {
        return palpate::Explicit{environment, SpringWall::inertia, Scene::coupling, period};
    };
    step(state, object, over(CompiledNetwork{object}), over(object), exactly);
}

template <class Scene>
void implicit_table(benchmark::State& state) {
    const WaveletNetwork object = Scene::object(size_of(state));
    implicit<Scene>(state, object, CompiledNetwork{object},
                    Resolvent{object.curve(), implicit_slope<Scene>()});
}

/// Newton's method in cells with a proved convergence, started by a predictor; if the object snaps through, in the
/// interval of each solution branch.
template <class Scene>
void implicit_newton(benchmark::State& state) {
    const WaveletNetwork object = Scene::object(size_of(state));
    if constexpr (std::is_same_v<Scene, SpringWall>) {
        implicit<Scene>(state, object, CompiledNetwork{object},
                        CertifiedSolver{palpate::piecewise(object.curve()), implicit_slope<Scene>()});
    } else {
        implicit<Scene>(state, object, CompiledNetwork{object},
                        Resolvent{object.curve(), implicit_slope<Scene>(), {1e-12, 0}});
    }
}

/// Implicit structure whose Newton's method evaluates the sum of wavelets, not the cells of a force table.
void implicit_newton_network(benchmark::State& state) {
    const WaveletNetwork object = SpringWall::object(size_of(state));
    implicit<SpringWall>(state, object, object,
                         CertifiedSolver{palpate::piecewise(object.curve()), implicit_slope<SpringWall>()});
}

/// Implicit structure with Newton's method without table cells, from the last position until its step is small.
void implicit_textbook(benchmark::State& state) {
    const WaveletNetwork object = SpringWall::object(size_of(state));
    implicit<SpringWall>(state, object, CompiledNetwork{object}, LoadLineSolver{});
}

template <class Scene>
void massless_table(benchmark::State& state) {
    const WaveletNetwork object = Scene::object(size_of(state));
    massless<Scene>(state, object, Resolvent{object.curve(), massless_slope<Scene>()});
}

void massless_newton(benchmark::State& state) {
    const WaveletNetwork object = SpringWall::object(size_of(state));
    massless<SpringWall>(state, object,
                         CertifiedSolver{palpate::piecewise(object.curve()), massless_slope<SpringWall>()});
}

void direct(benchmark::State& state) {
    const WaveletNetwork object = SpringWall::object(size_of(state));
    step(state, object, palpate::Direct{CompiledNetwork{object}}, palpate::Direct{object}, exactly);
}

/// Implicit structure with a single step of Newton's method, which is exact only if the force is a straight line.
void linearly_implicit(benchmark::State& state) {
    const WaveletNetwork object = SpringWall::object(size_of(state));
    step(state, object,
         palpate::Implicit{CompiledNetwork{object}, SpringWall::inertia, SpringWall::coupling, period,
                           palpate::bench::OneNewtonStep{}},
         palpate::Implicit{object, SpringWall::inertia, SpringWall::coupling, period}, 1e-3);
}

void trapezoidal(benchmark::State& state) {
    const WaveletNetwork object = SpringWall::object(size_of(state));
    const auto over = [&](const auto& environment) {
        return palpate::bench::Trapezoidal{environment, SpringWall::inertia, SpringWall::coupling, period};
    };
    step(state, object, over(CompiledNetwork{object}), over(object), 1e-10);
}

void energy_consistent(benchmark::State& state) {
    const WaveletNetwork object = SpringWall::object(size_of(state));
    const double p = palpate::EnergyConsistent<CompiledNetwork>::load_line_slope(
        SpringWall::inertia, SpringWall::coupling, period);
    const auto over = [&](const auto& environment, const auto& solver) {
        constexpr double none = std::numeric_limits<double>::infinity();
        return palpate::EnergyConsistent{
            environment, SpringWall::inertia, SpringWall::coupling, period, 1e-4, true, none, solver};
    };
    step(state, object, over(CompiledNetwork{object}, Resolvent{object.curve(), p}),
         over(object, LoadLineSolver{}), 1e-9);
}

void substepped(benchmark::State& state) {
    const WaveletNetwork object = SpringWall::object(size_of(state));
    const auto over = [&](const auto& environment) {
        return palpate::bench::Substepped{environment, SpringWall::inertia, SpringWall::coupling, period, 4};
    };
    step(state, object, over(CompiledNetwork{object}), over(object), exactly);
}

/// Measures the time to build the tables of a structure and to prove their error.
template <class Scene>
void build(benchmark::State& state) {
    const WaveletNetwork object = Scene::object(size_of(state));
    for (auto _ : state) {
        benchmark::DoNotOptimize(Resolvent{object.curve(), implicit_slope<Scene>()});
    }
    const Resolvent resolvent{object.curve(), implicit_slope<Scene>()};
    state.counters["cells"] = static_cast<double>(resolvent.cells());
    state.counters["certified_error"] = resolvent.position_error() / 0.6;
    if (!resolvent.tabulated()) {
        state.SkipWithError("no table");
    }
}

void sizes(benchmark::internal::Benchmark* benchmark) {
    benchmark->ArgName("wavelets")->Arg(16)->Arg(64);
}

}  // namespace

BENCHMARK_TEMPLATE(explicit_step, SpringWall)->Apply(sizes);
BENCHMARK_TEMPLATE(implicit_table, SpringWall)->Apply(sizes);
BENCHMARK_TEMPLATE(implicit_newton, SpringWall)->Apply(sizes);
BENCHMARK_TEMPLATE(massless_table, SpringWall)->Apply(sizes);
BENCHMARK_TEMPLATE(explicit_step, SnapThrough)->Apply(sizes);
BENCHMARK_TEMPLATE(implicit_table, SnapThrough)->Apply(sizes);
BENCHMARK_TEMPLATE(implicit_newton, SnapThrough)->Apply(sizes);
BENCHMARK_TEMPLATE(massless_table, SnapThrough)->Apply(sizes);
BENCHMARK(implicit_newton_network)->Apply(sizes);
BENCHMARK(implicit_textbook)->Apply(sizes);
BENCHMARK(massless_newton)->Apply(sizes);
BENCHMARK(linearly_implicit)->Apply(sizes);
BENCHMARK(trapezoidal)->Apply(sizes);
BENCHMARK(energy_consistent)->Apply(sizes);
BENCHMARK(substepped)->Apply(sizes);
BENCHMARK(direct)->Apply(sizes);
BENCHMARK_TEMPLATE(build, SpringWall)->Apply(sizes)->Unit(benchmark::kMillisecond);
BENCHMARK_TEMPLATE(build, SnapThrough)->Apply(sizes)->Unit(benchmark::kMillisecond);

BENCHMARK_MAIN();
