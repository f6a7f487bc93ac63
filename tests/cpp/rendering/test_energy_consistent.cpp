// SPDX-License-Identifier: Apache-2.0
// Tests of the energy-consistent integration: order of convergence, conserved energy, choice of the solution.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/model/limited_environment.hpp"
#include "palpate/rendering/compensated.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/rendering/energy_consistent.hpp"
#include "palpate/rendering/explicit.hpp"
#include "palpate/rendering/implicit.hpp"
#include "palpate/rendering/massless.hpp"
#include "palpate/solver/limited_resolvent.hpp"
#include "palpate/solver/resolvent.hpp"
#include "rendering/time_step_checks.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::coupling;
using test::Hardening;
using test::inertia;
using test::order;

TEST(EnergyConsistent, IsOfSecondOrderAndSwitchedOfFirstOrder) {
    EXPECT_NEAR(
        order([](double T) { return EnergyConsistent{Hardening{}, inertia, coupling, T, 1e-4, false}; }), 2.0,
        0.1);
    EXPECT_NEAR(order([](double T) { return EnergyConsistent{Hardening{}, inertia, coupling, T}; }), 1.0,
                0.15);
}

// An object without damping that oscillates keeps its amplitude.
TEST(EnergyConsistent, KeepsTheEnergyOfAnUndampedObject) {
    const Inertia mass{0.001, 0.0};
    const auto expect_kept = [&](const auto& object, auto structure) {
        structure.reset(0.3);
        const double start = object.at(0.3, {}).energy;
        for (int k = 0; k < 20'000; ++k) {
            const Rendered rendered = structure.drive(0.0);
            ASSERT_EQ(rendered.status, Status::Ok);
            const double energy = object.at(rendered.environment_position, {}).energy +
                                  0.5 * mass.mass * structure.velocity() * structure.velocity();
            ASSERT_NEAR(energy, start, 1e-8 * std::abs(start)) << k;
        }
    };
    expect_kept(Hardening{}, EnergyConsistent{Hardening{}, mass, coupling, 1e-3, 1e-4, false});
    const WaveletNetwork network{{1, {4.0}, {0.5}, {0.2}, {8.0}, 0.0}, test::unit_domain()};
    const double p = EnergyConsistent<WaveletNetwork>::load_line_slope(mass, {0.0, 0.0}, 1e-3);
    const Resolvent resolvent{network.curve(), p};
    ASSERT_TRUE(resolvent.unique(p));
    expect_kept(network, EnergyConsistent{network, mass, coupling, 1e-3, 1e-4, false,
                                          std::numeric_limits<double>::infinity(), resolvent});
}

TEST(EnergyConsistent, SwitchedStepNeverGivesEnergy) {
    const Hardening object;
    EnergyConsistent structure{object, {0.001, 0.0}, coupling, 1e-3};
    structure.reset(0.3);
    double before = object.at(0.3, {}).energy;
    for (int k = 0; k < 2000; ++k) {
        const Rendered rendered = structure.drive(0.0);
        const double energy = object.at(rendered.environment_position, {}).energy +
                              0.5 * 0.001 * structure.velocity() * structure.velocity();
        ASSERT_LE(energy, before + 1e-9) << k;
        before = energy;
    }
    EXPECT_LT(before, 0.5 * object.at(0.3, {}).energy);
}

/// Solution of one step of the energy-consistent structure from the position `from`, computed without the solver. The
/// step uses either the force f or the difference quotient D of the energy.
struct SwitchedStep {
    const WaveletNetwork& object;
    double from;
    LoadLine line;
    double energy = object.at(from, {}).energy;  ///< at `from`
    static constexpr double shortest = 5e-4;

    [[nodiscard]] double quotient(double y, double end) const { return (end - energy) / (y - from); }
    [[nodiscard]] double by_energy(double y) const {
        return quotient(y, object.at(y, {}).energy) + line.slope * y - line.intercept;
    }
    [[nodiscard]] double by_force(double y) const {
        return object.at(y, {}).force + line.slope * y - line.intercept;
    }
    [[nodiscard]] bool generates(double y) const {
        const EnvironmentSample end = object.at(y, {});
        return (end.force - quotient(y, end.energy)) * (y - from) < 0.0;
    }
    [[nodiscard]] double residual(double y) const {
        const EnvironmentSample end = object.at(y, {});
        const double mean = quotient(y, end.energy);
        return ((end.force - mean) * (y - from) < 0.0 ? mean : end.force) + line.slope * y - line.intercept;
    }

    /// Returns the position y nearest to `from` at which `function(y)` is zero, searched towards `to` by short steps
    /// and bisection.
    template <class F>
    [[nodiscard]] static double first_root(F function, double from, double to) {
        const double step = std::copysign(shortest, to - from);
        double near = from + 1e-9 * step;
        const bool negative = function(near) < 0.0;
        for (int k = 1; k * shortest < std::abs(to - from) && (function(from + k * step) < 0.0) == negative;
             ++k) {
            near = from + k * step;
        }
        double far = near + step;
        for (int k = 0; k < 60; ++k) {
            const double middle = 0.5 * (near + far);
            ((function(middle) < 0.0) == negative ? near : far) = middle;
        }
        return near;
    }
    [[nodiscard]] int roots(double to) const {
        const double step = std::copysign(shortest, to - from);
        int count = 0;
        double last = residual(from + 1e-9 * step);
        for (int k = 1; k * shortest < std::abs(to - from); ++k) {
            const double here = residual(from + k * step);
            count += (here < 0.0) != (last < 0.0) ? 1 : 0;
            last = here;
        }
        return count;
    }
    /// Returns the object position after the step, by the rule in the class comment of the energy-consistent structure.
    [[nodiscard]] double expected(double far) const {
        const double root = first_root([&](double y) { return by_energy(y); }, from, far);
        return generates(root) ? root : first_root([&](double y) { return by_force(y); }, from, root);
    }
};

// If the steepest falling slope s is 1.5 times the slope p of the load line, the energy-consistent step has up to
// three solutions. If s is 0.9 times p, it has one.
TEST(EnergyConsistent, SwitchedStepChoosesTheRootOfItsRule) {
    test::Random random{91};
    int three = 0;
    int tried = 0;
    for (int k = 0; k < test::cases(12); ++k) {
        const double fall_by_slope = k % 2 == 0 ? 1.5 : 0.9;
        const WaveletNetwork object{test::random_network(random, static_cast<std::size_t>(1 + k % 6)),
                                    test::unit_domain()};
        const PiecewiseForce force = piecewise(object.curve());
        const double fall = test::steepest_fall(force);
        if (!(fall > 0.1)) {
            continue;
        }
        const Inertia mass{0.5e-6 * fall / fall_by_slope, 0.0};
        const double p = EnergyConsistent<WaveletNetwork>::load_line_slope(mass, {0.0, 0.0}, 1e-3);
        const Resolvent resolvent{force, p};
        ASSERT_EQ(resolvent.unique(p), fall_by_slope < 1.0);
        EnergyConsistent structure{object, mass, coupling, 1e-3, 1e-4, true, 1e300, resolvent};
        for (int j = 0; j < 60; ++j) {
            const double from = test::uniform(random, 0.05, 0.95);
            const double to = test::uniform(random, -0.2, 1.2);
            const double push = test::uniform(random, 0.9, 1.1) * (object.at(to, {}).force + p * (to - from));
            const SwitchedStep step{object, from, {p, p * from + push}};
            structure.reset(from);
            const Rendered rendered = structure.drive(push);
            ASSERT_EQ(rendered.status, Status::Ok) << k << " " << j;
            const double far = step.by_force(from) < 0.0 ? from + 2.0 : from - 2.0;
            const double expected = step.expected(far);
            if (std::abs(expected - from) < 1e-3) {
                // In a short step the difference of two energies divided by the step has a large rounding error
                continue;
            }
            ++tried;
            ASSERT_NEAR(rendered.environment_position, expected, 1e-9)
                << k << " " << j << " from " << from << " push " << push;
            const int roots = step.roots(far);
            three += roots >= 3 ? 1 : 0;
            ASSERT_TRUE(fall_by_slope > 1.0 || roots == 1) << k << " " << j;
        }
    }
    EXPECT_GT(tried, test::cases(12) * 20);
    EXPECT_GT(three, tried / 600) << "the case is about steps with several roots";
}

/// Spring whose stiffness jumps from 1 to 100 at position 0.
struct TwoSprings {
    using State = Stateless;

    [[nodiscard]] EnvironmentSample at(double x, const State& /*stateless*/) const noexcept {
        const double k = x < 0.0 ? 1.0 : 100.0;
        return {k * x, k, 0.5 * k * x * x, false};
    }
    void advance(double /*x*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*x*/) const noexcept { return {}; }
};

TEST(EnergyConsistent, ShortStepAcrossAJumpOfTheSlopeGeneratesNoEnergy) {
    constexpr double shortest = 0.01;
    constexpr Inertia body{1e-4, 0.0};
    int across = 0;
    for (const bool switched : {true, false}) {
        for (int k = -20; k <= 20; ++k) {
            for (int j = -40; j <= 40; ++j) {
                const double from = 5e-4 * k;
                const double force = 0.1 * j;
                EnergyConsistent structure{TwoSprings{}, body, {1.0, 0.0}, 1e-3, shortest, switched};
                structure.reset(from);
                const double moved = structure.drive(force).environment_position - from;
                const double stored =
                    TwoSprings{}.at(from + moved, {}).energy - TwoSprings{}.at(from, {}).energy;
                const double kinetic = 0.5 * body.mass * structure.velocity() * structure.velocity();
                EXPECT_GE(force * moved - stored - kinetic, -1e-12) << from << " " << force;
                across += std::abs(moved) < shortest && from * (from + moved) < 0.0 ? 1 : 0;
            }
        }
    }
    EXPECT_GT(across, 100);
}

// docs/certificate.md, behind a coupling: in every step, G eta (force times displacement) is at least the increase of
// stored and kinetic energy, for any slope and any solution, also at a force limit. The mean force D replaces the force
// f only where f would generate energy. At the end of a free continuation the slope of f jumps.
TEST(EnergyConsistent, SwitchedStepSatisfiesTheEnergyInequality) {
    test::Random random{92};
    int most = 0;
    int most_without_tables = 0;
    int most_limited = 0;
    int limited = 0;
    for (int k = 0; k < test::cases(12); ++k) {
        const auto continuation = k % 2 == 0 ? Continuation::Free : Continuation::Linear;
        const WaveletNetwork object{test::random_network(random, static_cast<std::size_t>(1 + k % 12)),
                                    test::unit_domain(continuation, continuation)};
        const PiecewiseForce force = piecewise(object.curve());
        const double fall = std::max(0.1, test::steepest_fall(force));
        const double about = fall * std::exp(test::uniform(random, std::log(0.505), 1.0));
        const double share = test::uniform(random, 0.1, 0.9);
        const Inertia mass{0.5e-6 * share * about, 1e-3 * 0.1 * (1.0 - share) * about};
        const VirtualCoupling spring{0.9 * (1.0 - share) * about, 0.0};
        const double p = EnergyConsistent<WaveletNetwork>::load_line_slope(mass, spring, 1e-3);
        double finest = 1.0;
        for (const double alpha : object.parameters().alpha) {
            finest = std::min(finest, 1.0 / alpha);
        }
        const auto check = [&](auto structure, Inertia body, int& worst) {
            structure.reset(0.5);
            double y = 0.5;
            double velocity = 0.0;
            double device = 0.5;
            for (int j = 0; j < 300; ++j) {
                device = j % 3 == 0 ? test::uniform(random, -0.2, 1.2)
                                    : device + test::uniform(random, -0.02, 0.02);
                const Rendered rendered = structure.step(device);
                ASSERT_TRUE(rendered.status == Status::Ok || rendered.status == Status::Limited)
                    << k << " " << j;
                limited += rendered.status == Status::Limited ? 1 : 0;
                const double eta = rendered.environment_position - y;
                const EnvironmentSample end = object.at(rendered.environment_position, {});
                const double stored = end.energy - object.at(y, {}).energy;
                const double gain =
                    stored +
                    0.5 * body.mass * (structure.velocity() * structure.velocity() - velocity * velocity);
                const double work = rendered.force * eta - body.damping * eta * eta / 1e-3;
                const double size = 1.0 + p * (1.0 + y * y) + body.mass * velocity * velocity;
                ASSERT_GE(work - gain, -1e-11 * size) << k << " " << j << " p / s = " << p / fall;
                if (std::abs(eta) > 1e-2) {
                    const double used = rendered.force - body.damping * eta / 1e-3 -
                                        2e3 * body.mass * (eta / 1e-3 - velocity);
                    const double mean = stored / eta;
                    const double expected = (end.force - mean) * eta < 0.0 ? mean : end.force;
                    ASSERT_NEAR(used, expected, 1e-9 * size) << k << " " << j;
                }
                y = rendered.environment_position;
                velocity = structure.velocity();
                worst = std::max(worst, rendered.evaluations);
            }
        };
        const double infinity = std::numeric_limits<double>::infinity();
        check(
            EnergyConsistent{object, mass, spring, 1e-3, 1e-2 * finest, true, infinity, Resolvent{force, p}},
            mass, most);
        check(EnergyConsistent{object, mass, spring, 1e-3, 1e-2 * finest}, mass, most_without_tables);
        const Inertia heavy{0.5e-6 * about, 0.0};
        check(EnergyConsistent{object, heavy, spring, 1e-3, 1e-2 * finest, true, 0.1 * about}, heavy,
              most_limited);
    }
    RecordProperty("most_evaluations", most);
    RecordProperty("most_evaluations_without_tables", most_without_tables);
    RecordProperty("most_evaluations_limited", most_limited);
    EXPECT_GT(limited, test::cases(12) * 30);
    EXPECT_LE(most, 48);
    EXPECT_LE(most_without_tables, 80);
    EXPECT_LE(most_limited, 80);
}

TEST(EnergyConsistent, BothStepsReachTheSameForceBehindTheCoupling) {
    test::expect_the_force_of_the_coupling_at_rest(Implicit{Hardening{}, inertia, coupling, 1e-3});
    test::expect_the_force_of_the_coupling_at_rest(EnergyConsistent{Hardening{}, inertia, coupling, 1e-3});
    test::expect_the_force_of_the_coupling_at_rest(
        EnergyConsistent{Hardening{}, inertia, coupling, 1e-3, 1e-4, false});
    test::expect_the_force_of_the_coupling_at_rest(Explicit{Hardening{}, inertia, coupling, 1e-3});
}

TEST(EnergyConsistent, NanGivesZeroForceAndTheNextStepContinues) {
    test::expect_nan_is_refused(EnergyConsistent{Hardening{}, inertia, coupling, 1e-3});
}

/// Object whose force is a rising polynomial of degree five.
struct Quintic {
    using State = Stateless;

    [[nodiscard]] EnvironmentSample at(double x, const State& /*stateless*/) const noexcept {
        const double x2 = x * x;
        return {8.0 * x + 3.0 * x2 + 2.0 * x * x2 + x2 * x2 * x, 8.0 + 6.0 * x + 6.0 * x2 + 5.0 * x2 * x2,
                4.0 * x2 + x * x2 + 0.5 * x2 * x2 + x2 * x2 * x2 / 6.0, false};
    }
    void advance(double /*x*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*x*/) const noexcept { return {}; }
};

// Three Gauss points integrate polynomials up to degree five exactly, so both ways to compute the mean force agree.
TEST(EnergyConsistent, MeanForceFromGaussPointsIsThatFromTheEnergy) {
    test::Random random{17};
    for (const bool switched : {false, true}) {
        constexpr double period = 0.1;
        constexpr double always = 1e9;
        EnergyConsistent by_points{Quintic{}, {0.5, 0.3}, {20.0, 0.02}, period, always, switched};
        EnergyConsistent by_energy{Quintic{}, {0.5, 0.3}, {20.0, 0.02}, period, 0.0, switched};
        double farthest = 0.0;
        for (int k = 0; k < 300; ++k) {
            const double device = test::uniform(random, -1.5, 1.5);
            const Rendered points = by_points.step(device);
            const Rendered energy = by_energy.step(device);
            ASSERT_NEAR(points.environment_position, energy.environment_position, 1e-7) << k;
            ASSERT_NEAR(points.force, energy.force, 1e-5) << k;
            farthest = std::max(farthest, std::abs(energy.environment_position));
        }
        EXPECT_GT(farthest, 0.3);
    }
}

/// Moves a handle over a wide range, and compares the stated evaluations of each tick with the counted ones. Returns
/// the mean number of evaluations in a tick.
template <class S>
double mean_evaluations(S structure, const int& count) {
    test::Random random{23};
    structure.reset(0.0);
    int all = 0;
    constexpr int ticks = 400;
    for (int k = 0; k < ticks; ++k) {
        const int before = count;
        const Rendered rendered = structure.step(test::uniform(random, -0.5, 0.5));
        EXPECT_EQ(rendered.evaluations, count - before) << k;
        all += rendered.evaluations;
    }
    if constexpr (requires { structure.drive(1.0); }) {
        const int before = count;
        const Rendered rendered = structure.drive(1.0);
        EXPECT_EQ(rendered.evaluations, count - before);
    }
    return static_cast<double>(all) / ticks;
}

// The largest means are 5 % above the means at the time of writing. Newton's method needs more with a wrong slope.
TEST(EnergyConsistent, StatesItsEvaluationsAndNeedsFew) {
    constexpr double period = 1e-2;
    constexpr double none = std::numeric_limits<double>::infinity();
    int count = 0;
    const test::Counted<Hardening> object{{}, &count};
    const auto mean = [&](bool switched, double limit, double shortest = 0.0) {
        return mean_evaluations(
            EnergyConsistent{object, inertia, coupling, period, shortest, switched, limit}, count);
    };
    EXPECT_LT(mean(false, none), 8.27);
    EXPECT_LT(mean(true, none), 13.7);
    EXPECT_LT(mean(false, 3.0), 12.3);
    EXPECT_LT(mean(true, 3.0), 17.8);
    // A mean force from Gauss points needs three more; its slope is about f' / 2.
    EXPECT_LT(mean(false, none, 1e9), 25.2);
    EXPECT_LT(mean(true, none, 1e9), 36.3);
    EXPECT_LT(mean(true, 3.0, 1e9), 46.8);
    const auto implicit = [&](double limit) {
        return mean_evaluations(
            Implicit<test::Counted<Hardening>>{object, inertia, coupling, period, {}, limit}, count);
    };
    EXPECT_LT(implicit(none), 4.23);
    EXPECT_LT(implicit(3.0), 7.83);
    EXPECT_LT(mean_evaluations(Massless{object, coupling, period}, count), 5.62);
    EXPECT_LT(mean_evaluations(Massless{LimitedEnvironment{object, 3.0}, coupling, period,
                                        LimitedResolvent{LoadLineSolver{}}},
                               count),
              5.62);
    EXPECT_EQ(mean_evaluations(Explicit{object, inertia, coupling, 1e-3}, count), 1.0);
    EXPECT_EQ(mean_evaluations(Direct{object}, count), 1.0);
    EXPECT_EQ(mean_evaluations(PredictedDirect{object, 4}, count), 1.0);
}

// A force that rises generates no energy, so its table is sufficient. Two evaluations check this.
TEST(EnergyConsistent, StatesTheEvaluationsOfStepsWithTables) {
    constexpr double period = 1e-3;
    constexpr double none = std::numeric_limits<double>::infinity();
    int count = 0;
    const WaveletNetwork network{{1, {4.0, 9.0}, {0.5, 0.2}, {0.2, 0.05}, {8.0}, 0.1}, test::unit_domain()};
    const test::Counted<WaveletNetwork> object{network, &count};
    const Inertia mass{1e-5, 0.0};
    const VirtualCoupling spring{20.0, 0.0};
    const double p = EnergyConsistent<WaveletNetwork>::load_line_slope(mass, spring, period);
    const auto mean = [&](double slope, bool switched, double shortest, double limit) {
        return mean_evaluations(EnergyConsistent{object, mass, spring, period, shortest, switched, limit,
                                                 Resolvent{network.curve(), slope}},
                                count);
    };
    EXPECT_EQ(mean(p, true, 0.0, none), 2.0);
    const Compensated compensated{object, 100.0};
    EXPECT_GE(mean_evaluations(Massless{compensated, VirtualCoupling{100.0, 0.0}, period,
                                        CompensatedResolvent{piecewise(network.curve()), 100.0, 100.0}},
                               count),
              1.0);
    for (const double shortest : {0.0, 1e-3, 1e9}) {
        for (const double limit : {1.0, none}) {
            for (const bool switched : {false, true}) {
                EXPECT_GT(mean(p, switched, shortest, limit), 1.0);
                EXPECT_GT(mean(2.0 * p, switched, shortest, limit), 1.0) << "a table for another slope";
            }
        }
    }
}

/// Solver with a table that contains one solution, which may be wrong. It does not prove that there is one solution.
struct OneAnswer {
    using Memory = WarmStart;
    Solution answer;

    [[nodiscard]] static bool tabulated() noexcept { return true; }
    [[nodiscard]] static bool unique(double) noexcept { return false; }
    template <Environment E>
    [[nodiscard]] Solution solve(const E& /*environment*/, const typename E::State& /*state*/,
                                 LoadLine /*line*/, Memory& /*memory*/) const noexcept {
        return answer;
    }
};

// With the mass 1/2 and the period 1, the slope p is 1. A spring of stiffness 2 moves to 4 / (2 + 1) under the force 4.
// With its mean force it would move to 4 / (1 + 1) = 2.
TEST(EnergyConsistent, UsesATableOnlyBetweenTheLastPositionAndThatOfTheMeanForce) {
    const auto position = [](double answer, Status status) {
        int count = 0;
        const test::Counted<test::Spring> object{{2.0}, &count};
        EnergyConsistent structure{object,
                                   {0.5, 0.0},
                                   coupling,
                                   1.0,
                                   0.0,
                                   true,
                                   std::numeric_limits<double>::infinity(),
                                   OneAnswer{{answer, {}, 0.0, 7, status}}};
        const Rendered rendered = structure.drive(4.0);
        EXPECT_EQ(rendered.status, Status::Ok);
        EXPECT_EQ(rendered.evaluations, count + 7) << answer;
        return rendered.environment_position;
    };
    constexpr double by_force = 4.0 / 3.0;
    for (const double inside : {0.0, 0.5, 1.0, 2.0}) {
        EXPECT_EQ(position(inside, Status::Ok), inside);
        EXPECT_NEAR(position(inside, Status::MaxIterations), by_force, 1e-12);
    }
    for (const double outside : {-0.1, 2.1, std::numeric_limits<double>::quiet_NaN()}) {
        EXPECT_NEAR(position(outside, Status::Ok), by_force, 1e-12);
    }
}

TEST(EnergyConsistent, StatesThatALoadLineIsNotUnique) {
    EnergyConsistent structure{test::Spring{-8.0}, {0.5, 0.0}, coupling, 1.0};
    EXPECT_EQ(structure.drive(0.0).status, Status::NotUnique);
}

// A fast mass, which the limited force of the coupling cannot stop, moves to a position without a force.
template <class S>
void expect_a_failed_limited_step_is_refused(S structure) {
    structure.reset(0.0);
    EXPECT_EQ(structure.drive(10.0).status, Status::Ok);
    const double reached = structure.drive(10.0).environment_position;
    EXPECT_GT(reached, 0.25);
    EXPECT_LT(reached, 0.5);
    S reference = structure;
    for (const double device : {-100.0, -50.0}) {
        const Rendered refused = structure.step(device);
        EXPECT_EQ(refused.status, Status::NonFinite);
        EXPECT_EQ(refused.force, 0.0);
        EXPECT_EQ(refused.environment_position, reached);
    }
    EXPECT_EQ(structure.drive(10.0).status, Status::NonFinite);
    const Rendered expected = reference.drive(-30.0);
    const Rendered now = structure.drive(-30.0);
    EXPECT_EQ(expected.status, Status::Ok);
    EXPECT_EQ(now.status, Status::Ok);
    EXPECT_EQ(now.environment_position, expected.environment_position);
    EXPECT_EQ(now.force, -30.0);
    EXPECT_EQ(structure.step(0.0).force, reference.step(0.0).force);
}

TEST(EnergyConsistent, FailedLimitedStepIsRefusedAndKeepsTheState) {
    constexpr Inertia mass{1.0, 0.0};
    constexpr VirtualCoupling stiff{1e4, 0.5};
    constexpr double period = 0.125;
    expect_a_failed_limited_step_is_refused(
        EnergyConsistent{test::BrokenBeyond{}, mass, stiff, period, 1e-4, true, 0.5});
    expect_a_failed_limited_step_is_refused(Implicit<test::BrokenBeyond>{{}, mass, stiff, period, {}, 0.5});
}

// With the mass 1, the period 1/2 and the coupling stiffness 8, the object moves to half of the handle's position.
TEST(EnergyConsistent, ForceAtTheLimitIsNotLimited) {
    constexpr Inertia mass{1.0, 0.0};
    const auto status = [&](double limit) {
        EnergyConsistent structure{test::Spring{0.0}, mass, {8.0, 0.0}, 0.5, 0.0, true, limit};
        const Rendered rendered = structure.step(1.0);
        EXPECT_NEAR(rendered.force, 4.0, 1e-12);
        return rendered.status;
    };
    EXPECT_EQ(status(4.0), Status::Ok);
    EXPECT_EQ(status(std::nextafter(4.0, 0.0)), Status::Limited);
    const auto implicit = [&](double limit) {
        Implicit<test::Spring> structure{test::Spring{0.0}, mass, {4.0, 0.0}, 0.5, {}, limit};
        const Rendered rendered = structure.step(1.0);
        EXPECT_NEAR(rendered.force, 2.0, 1e-12);
        return rendered.status;
    };
    EXPECT_EQ(implicit(2.0), Status::Ok);
    EXPECT_EQ(implicit(std::nextafter(2.0, 0.0)), Status::Limited);
}

}  // namespace
}  // namespace palpate
