// SPDX-License-Identifier: Apache-2.0
// Measures force error and time of every structure and solver. A hand presses through a click and a wall on a simulated
// knob. Counters are the RMS force errors of palpate/simulation/force_error.hpp: at the end of a tick, at its sampling
// instant, of its mean, and of the mean below 50 Hz.

#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "palpate/io/model_file.hpp"
#include "palpate/model/compiled_network.hpp"
#include "palpate/rendering/compensated.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/rendering/energy_consistent.hpp"
#include "palpate/rendering/explicit.hpp"
#include "palpate/rendering/implicit.hpp"
#include "palpate/rendering/massless.hpp"
#include "palpate/run/controller.hpp"
#include "palpate/simulation/force_error.hpp"
#include "palpate/simulation/simulated_device.hpp"
#include "palpate/solver/resolvent.hpp"
#include "time_steps.hpp"

namespace {

using palpate::CompiledNetwork;
using palpate::WaveletNetwork;

constexpr double period = 1e-3;
constexpr std::size_t ticks = 4000;
constexpr palpate::VirtualCoupling coupling{100.0, 0.02};
constexpr palpate::VirtualCoupling softer_damper{100.0, 0.005};
constexpr palpate::Inertia papers{0.001, 0.5};
constexpr palpate::Inertia undamped{0.001, 0.0};

const WaveletNetwork& sum() {
    static const palpate::ModelFile file =
        palpate::load_model_file(PALPATE_SOURCE_DIR "/bench/solvers/click_and_wall.json");
    return *file.model.network();
}

const CompiledNetwork& compiled() {
    static const CompiledNetwork table{sum()};
    return table;
}

palpate::Resolvent resolvent(double p) {
    return palpate::Resolvent{sum().curve(), p};
}

double massless_slope() {
    return palpate::Massless<CompiledNetwork>::load_line_slope(coupling, period);
}

double implicit_slope(palpate::Inertia inertia) {
    return palpate::Implicit<CompiledNetwork>::load_line_slope(inertia, coupling, period);
}

/// Force errors and motion of a structure in a simulated loop with device and hand.
struct LoopResult {
    palpate::ForceError error;
    double force = 0.0;  ///< RMS of the model force f along the motion
    double evaluations = 0.0;
    std::vector<double> motion;
    palpate::Status status = palpate::Status::Ok;
};

template <class S>
LoopResult closed_loop(S structure) {
    palpate::SimulatedDevice device{palpate::DeviceProfile{}};
    (void)device.open();
    palpate::Controller controller{device, std::move(structure), palpate::ForceLimit{}};
    (void)controller.start();
    LoopResult result;
    std::vector<double> start;
    std::vector<double> middle;
    std::vector<double> end;
    std::vector<double> applied;
    for (std::size_t k = 0; k < ticks; ++k) {
        const palpate::Motion before = device.handle();
        const palpate::Tick tick = controller.tick();
        result.status = tick.status == palpate::Status::Ok ? result.status : tick.status;
        const palpate::Motion after = device.handle();
        start.push_back(before.position);
        middle.push_back(0.5 * (before.position + after.position) +
                         0.125 * period * (before.velocity - after.velocity));
        end.push_back(after.position);
        applied.push_back(tick.command.force);
        result.force += std::pow(sum().at(after.position, {}).force, 2);
        result.evaluations += tick.rendered.evaluations;
        result.motion.push_back(tick.reading.position);
    }
    constexpr auto count = static_cast<double>(ticks);
    result.force = std::sqrt(result.force / count);
    result.error = palpate::force_error({start, middle, end, applied, applied}, period,
                                        [](std::span<const double> motion, double /*step_s*/) {
                                            std::vector<double> force;
                                            for (const double x : motion) {
                                                force.push_back(sum().at(x, {}).force);
                                            }
                                            return force;
                                        });
    result.evaluations /= count;
    return result;
}

/// `expected` is the force error of the structure at the end of a tick [N*m], which no choice of solver changes.
template <class S>
void tick(benchmark::State& state, const S& initial, double expected) {
    const LoopResult result = closed_loop(initial);
    if (result.status != palpate::Status::Ok || !(std::abs(result.error.end - expected) <= 0.05 * expected)) {
        state.SkipWithError(
            ("force error " + std::to_string(result.error.end) + " N*m, " + palpate::text(result.status).word)
                .c_str());
        return;
    }
    S structure = initial;
    structure.reset(result.motion.front());
    std::size_t k = 0;
    for (auto _ : state) {
        benchmark::DoNotOptimize(structure.step(result.motion[k]));
        if (++k == result.motion.size()) {
            k = 0;
            structure.reset(result.motion.front());
        }
    }
    state.counters["force_error_end_Nm"] = result.error.end;
    state.counters["force_error_instant_Nm"] = result.error.instant;
    state.counters["force_error_mean_Nm"] = result.error.mean;
    state.counters["force_error_below_50_Hz_Nm"] = result.error.band;
    state.counters["force_rms_Nm"] = result.force;
    state.counters["evaluations"] = result.evaluations;
}

// Expected force errors of the structures at the end of a tick for the benchmark's object [N*m].
constexpr double of_the_hold = 0.00362;
constexpr double of_the_predicted_hold = 0.00194;
constexpr double of_the_coupling = 0.1202;
constexpr double of_the_mass = 0.1231;
constexpr double of_the_papers_damping = 0.2530;

void direct_sum(benchmark::State& state) {
    tick(state, palpate::Direct{sum()}, of_the_hold);
}
void direct_table(benchmark::State& state) {
    tick(state, palpate::Direct{compiled()}, of_the_hold);
}

void predicted_table(benchmark::State& state) {
    tick(state, palpate::PredictedDirect{compiled(), 4}, of_the_predicted_hold);
}

void compensated_newton(benchmark::State& state) {
    const palpate::Compensated object{compiled(), softer_damper.stiffness};
    tick(state, palpate::Massless{object, softer_damper, period}, of_the_hold);
}
void compensated_table(benchmark::State& state) {
    const palpate::Compensated object{compiled(), softer_damper.stiffness};
    const double p = palpate::Massless<CompiledNetwork>::load_line_slope(softer_damper, period);
    const palpate::CompensatedResolvent solver{palpate::piecewise(sum().curve()), softer_damper.stiffness, p};
    tick(state, palpate::Massless{object, softer_damper, period, solver}, of_the_hold);
}

void massless_newton(benchmark::State& state) {
    tick(state, palpate::Massless{compiled(), coupling, period}, of_the_coupling);
}
void massless_certified_newton(benchmark::State& state) {
    const palpate::CertifiedSolver solver{palpate::piecewise(sum().curve()), massless_slope()};
    tick(state, palpate::Massless{compiled(), coupling, period, solver}, of_the_coupling);
}
void massless_table(benchmark::State& state) {
    tick(state, palpate::Massless{compiled(), coupling, period, resolvent(massless_slope())},
         of_the_coupling);
}

void implicit_newton(benchmark::State& state) {
    tick(state, palpate::Implicit{compiled(), undamped, coupling, period}, of_the_mass);
}
void implicit_certified_newton(benchmark::State& state) {
    const palpate::CertifiedSolver solver{palpate::piecewise(sum().curve()), implicit_slope(undamped)};
    tick(state, palpate::Implicit{compiled(), undamped, coupling, period, solver}, of_the_mass);
}
void implicit_table(benchmark::State& state) {
    tick(state,
         palpate::Implicit{compiled(), undamped, coupling, period, resolvent(implicit_slope(undamped))},
         of_the_mass);
}
void implicit_one_step(benchmark::State& state) {
    tick(state, palpate::Implicit{compiled(), undamped, coupling, period, palpate::bench::OneNewtonStep{}},
         of_the_mass);
}

void damped_implicit_newton(benchmark::State& state) {
    tick(state, palpate::Implicit{compiled(), papers, coupling, period}, of_the_papers_damping);
}
void damped_implicit_table(benchmark::State& state) {
    tick(state, palpate::Implicit{compiled(), papers, coupling, period, resolvent(implicit_slope(papers))},
         of_the_papers_damping);
}

void trapezoidal_newton(benchmark::State& state) {
    tick(state, palpate::bench::Trapezoidal{compiled(), papers, coupling, period}, of_the_papers_damping);
}
void energy_consistent_newton(benchmark::State& state) {
    tick(state, palpate::EnergyConsistent{compiled(), papers, coupling, period}, of_the_papers_damping);
}

void explicit_sum(benchmark::State& state) {
    tick(state, palpate::Explicit{sum(), papers, coupling, period}, of_the_papers_damping);
}
void explicit_table(benchmark::State& state) {
    tick(state, palpate::Explicit{compiled(), papers, coupling, period}, of_the_papers_damping);
}
void explicit_substepped(benchmark::State& state) {
    tick(state, palpate::bench::Substepped{compiled(), papers, coupling, period, 4}, of_the_papers_damping);
}

}  // namespace

BENCHMARK(direct_sum);
BENCHMARK(direct_table);
BENCHMARK(predicted_table);
BENCHMARK(compensated_newton);
BENCHMARK(compensated_table);
BENCHMARK(massless_newton);
BENCHMARK(massless_certified_newton);
BENCHMARK(massless_table);
BENCHMARK(implicit_newton);
BENCHMARK(implicit_certified_newton);
BENCHMARK(implicit_table);
BENCHMARK(implicit_one_step);
BENCHMARK(damped_implicit_newton);
BENCHMARK(damped_implicit_table);
BENCHMARK(trapezoidal_newton);
BENCHMARK(energy_consistent_newton);
BENCHMARK(explicit_sum);
BENCHMARK(explicit_table);
BENCHMARK(explicit_substepped);

BENCHMARK_MAIN();
