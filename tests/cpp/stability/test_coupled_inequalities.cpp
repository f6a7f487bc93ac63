// SPDX-License-Identifier: Apache-2.0
// Tests inequalities of the certificate for structures with a virtual coupling. Optimised motions try to take energy
// out; an independent account sums force times motion, plus damping, sample by sample. The simulated devices are not
// used.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <ostream>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/model/limited_environment.hpp"
#include "palpate/rendering/energy_consistent.hpp"
#include "palpate/rendering/implicit.hpp"
#include "palpate/rendering/massless.hpp"
#include "palpate/solver/limited_resolvent.hpp"
#include "palpate/stability/certificate.hpp"
#include "palpate/stability/coupled_inequalities.hpp"
#include "palpate/stability/coupling_need.hpp"
#include "palpate/stability/direct_inequalities.hpp"
#include "support.hpp"

namespace palpate {
namespace {

/// A spring with bumps in its stored energy, V = K x^2 / 2 + sum of a exp(-((x - c) / w)^2).
struct Bumps {
    using State = Stateless;
    struct Bump {
        double height, centre, width;
    };
    double stiffness = 0.0;
    std::vector<Bump> bumps;

    [[nodiscard]] EnvironmentSample at(double x, const State& /*stateless*/) const noexcept {
        EnvironmentSample sample{stiffness * x, stiffness, 0.5 * stiffness * x * x, false};
        for (const Bump& bump : bumps) {
            const double u = (x - bump.centre) / bump.width;
            const double bell = bump.height * std::exp(-u * u);
            sample.energy += bell;
            sample.force -= 2.0 * u / bump.width * bell;
            sample.slope += (4.0 * u * u - 2.0) / (bump.width * bump.width) * bell;
        }
        return sample;
    }
    void advance(double /*x*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*x*/) const noexcept { return {}; }

    /// Returns the steepest slopes of the force, with a margin because only positions at distances of 0.002 are
    /// evaluated.
    [[nodiscard]] Interval slopes() const {
        Interval found{stiffness, stiffness};
        for (double x = -6.0; x <= 6.0; x += 0.002) {
            found = found.with({at(x, {}).slope, at(x, {}).slope});
        }
        const double margin = bumps.empty() ? 0.0 : 1e-3 * found.largest();
        return {found.lower - margin, found.upper + margin};
    }

    /// Returns the stored energy at a position minus the least stored energy, for the force clipped to a limit.
    [[nodiscard]] double held(double place, double limit) const {
        constexpr double step = 1e-3;
        double energy = 0.0;
        double least = 0.0;
        double there = 0.0;
        double last = std::clamp(at(-8.0, {}).force, -limit, limit);
        for (double x = -8.0 + step; x <= 8.0; x += step) {
            const double force = std::clamp(at(x, {}).force, -limit, limit);
            energy += 0.5 * step * (last + force);
            last = force;
            least = std::min(least, energy);
            there = x <= place ? energy : there;
        }
        return there - least;
    }
};

/// A scene with the period T = 1 of the control loop and the coupling stiffness K_c = 1.
struct CoupledScene {
    Bumps object;
    Scheme scheme;
    DeviceProfile device;
    Interval slopes;
    bool switched = true;
    double start = 0.0;
    double held = 0.0;
};

std::ostream& operator<<(std::ostream& out, const CoupledScene& scene) {
    return out << name_of(scene.scheme.structure) << ", B_c = " << scene.scheme.coupling.damping
               << ", m = " << scene.scheme.inertia.mass << ", B_o = " << scene.scheme.inertia.damping
               << ", slopes " << scene.slopes.lower << " to " << scene.slopes.upper << ", limit "
               << scene.device.force_limit << ", delay " << scene.device.delay_s
               << ", b = " << scene.device.viscous_damping;
}

/// Returns three sums: the least energy that a hand has put in after any sample, the energy after the last sample, and
/// the total exchanged energy. `parts` contains, for each sample, the motion before the command changes and the motion
/// after the change.
struct Account {
    double least = 0.0;
    double last = 0.0;  ///< energy that the hand has put in after the last sample
    double throughput = 0.0;
};

using Parts = std::vector<std::pair<double, double>>;

template <class S>
Account account_of(S structure, const CoupledScene& scene, const Parts& parts) {
    const int whole = scene.device.whole_delay_samples();
    const double share = scene.device.delay_fraction();
    std::vector<double> forces(static_cast<std::size_t>(whole) + 1, 0.0);
    double x = scene.start;
    double energy = 0.0;
    Account account;
    structure.reset(x);
    for (const auto& [before, after] : parts) {
        const Rendered rendered = structure.step(x);
        EXPECT_TRUE(rendered.status == Status::Ok || rendered.status == Status::Limited);
        forces.push_back(rendered.force);
        const std::size_t now = forces.size() - 1 - static_cast<std::size_t>(whole);
        const double work = forces[now - 1] * before + forces[now] * after;
        const double dissipated =
            scene.device.viscous_damping *
            ((share > 0.0 ? before * before / share : 0.0) + after * after / (1.0 - share));
        energy += work + dissipated;
        account.throughput += std::abs(work) + dissipated;
        account.least = std::min(account.least, energy);
        account.last = energy;
        x += before + after;
    }
    return account;
}

Account account_of(const CoupledScene& scene, const Parts& parts) {
    const Scheme& scheme = scene.scheme;
    const double limit = scene.device.force_limit;
    switch (scheme.structure) {
        case StructureKind::Massless:
            return account_of(Massless{LimitedEnvironment{scene.object, limit}, scheme.coupling, 1.0,
                                       LimitedResolvent{LoadLineSolver{}}},
                              scene, parts);
        case StructureKind::Implicit:
            return account_of(
                Implicit{scene.object, scheme.inertia, scheme.coupling, 1.0, LoadLineSolver{}, limit}, scene,
                parts);
        default:
            return account_of(EnergyConsistent{scene.object, scheme.inertia, scheme.coupling, 1.0, 1e-3,
                                               scene.switched, limit},
                              scene, parts);
    }
}

/// Sets the device damping to `share` times the damping that the certificate requires. Returns false if no damping is
/// sufficient.
bool set_damping(CoupledScene& scene, double share) {
    ForceBounds bounds;
    bounds.slope = scene.slopes;
    bounds.steepest = bounds.sliding = bounds.slope.largest();
    scene.device.viscous_damping = 1e9;
    const Certificate generous = certify(bounds, scene.scheme, scene.device);
    for (const Inequality& line : generous.inequalities) {
        if (line.left == 1e9) {
            scene.device.viscous_damping = share * line.right;
        }
    }
    return generous.certified();
}

CoupledScene random_scene(test::Random& random, bool linear) {
    constexpr std::array kinds{StructureKind::Massless, StructureKind::Implicit,
                               StructureKind::EnergyConsistent};
    CoupledScene scene;
    scene.scheme.structure = kinds[random() % kinds.size()];
    scene.switched = random() % 2 == 0;
    scene.scheme.coupling = {1.0, random() % 3 == 0 ? 0.0 : test::uniform(random, 0.01, 1.0)};
    scene.object.stiffness = linear && random() % 2 == 0 ? 0.0 : std::exp(test::uniform(random, -3.0, 4.0));
    for (std::size_t bumps = linear ? 0 : 1 + random() % 3; bumps > 0; --bumps) {
        scene.object.bumps.push_back({test::uniform(random, -0.3, 0.3), test::uniform(random, -1.0, 1.0),
                                      std::exp(test::uniform(random, -2.0, 0.0))});
    }
    scene.slopes = scene.object.slopes();
    scene.scheme.inertia = {std::exp(test::uniform(random, -2.0, 4.0)),
                            random() % 2 == 0 ? 0.0 : test::uniform(random, 0.0, 3.0)};
    scene.device.period_s = 1.0;
    scene.device.encoder_step = 0.0;
    scene.device.delay_s = static_cast<double>(random() % 3);
    if (random() % 3 == 0) {
        scene.device.delay_s += test::uniform(random, 0.1, 0.9);
    }
    scene.device.force_limit = random() % 4 == 0 ? 1e9 : std::exp(test::uniform(random, -3.0, 1.0));
    // Starts at rest at the nearest position at which the force is zero.
    for (int k = 0; k < 300 && !linear; ++k) {
        const double force = scene.object.at(scene.start, {}).force;
        scene.start -= std::clamp(force / scene.slopes.largest(), -0.1, 0.1);
    }
    const bool mass = has_mass(scene.scheme.structure);
    scene.held = linear ? 0.0
                        : scene.object.held(scene.start, mass ? std::numeric_limits<double>::infinity()
                                                              : scene.device.force_limit) +
                              1e-5;
    return scene;
}

/// Returns the least energy that optimised motions leave, divided by their throughput. Tries swings of many
/// frequencies, sizes and lengths, strokes with rests between, then random changes of the best motion.
double optimised(test::Random& random, const CoupledScene& scene, int trials) {
    const std::size_t samples = 60 + random() % 120;
    const double share = scene.device.delay_fraction();
    const double size = std::min(1.0, scene.device.force_limit);
    double least = 0.0;
    double best_value = std::numeric_limits<double>::infinity();
    Parts best;
    const auto consider = [&](const Parts& parts) {
        const Account account = account_of(scene, parts);
        const double handled = account.throughput + 1e-12;
        if (account.least + scene.held < -1e-9 * (1e-3 + account.throughput)) {
            least = std::min(least, (account.least + scene.held) / handled);
        }
        if (account.last / handled < best_value) {
            best_value = account.last / handled;
            best = parts;
        }
    };
    for (int trial = 0; trial < trials && least == 0.0; ++trial) {
        Parts parts = best;
        if (trial < trials / 2 || parts.empty()) {
            const double slow = std::sqrt(1.0 / scene.scheme.inertia.mass) * test::uniform(random, 0.8, 1.3);
            const double theta = random() % 4 == 0   ? std::numbers::pi
                                 : random() % 2 == 0 ? std::min(slow, std::numbers::pi)
                                                     : test::uniform(random, 0.02, std::numbers::pi);
            const double reach = size * std::exp(test::uniform(random, -5.0, 2.0));
            const double phase = test::uniform(random, 0.0, 2.0 * std::numbers::pi);
            const double first = share > 0.0 ? test::uniform(random, 0.0, 1.2) : 0.0;
            const std::size_t end = samples / 2 + random() % (samples / 2);
            parts.assign(samples, {0.0, 0.0});
            // The handle moves at constant speed in each stroke and rests between the strokes.
            const bool strokes = random() % 2 == 0;
            double speed = 0.0;
            for (std::size_t k = 0; k < end; ++k) {
                if (random() % 12 == 0) {
                    speed = random() % 2 == 0 ? 0.0 : reach * test::uniform(random, -1.0, 1.0);
                }
                const double d =
                    strokes ? speed : reach * std::sin(theta * static_cast<double>(k + 1) + phase);
                parts[k] = {first * d, (1.0 - first) * d};
            }
        } else {
            const double scale = std::exp(test::uniform(random, -6.0, 0.5));
            double largest = 0.0;
            for (const auto& [before, after] : parts) {
                largest = std::max(largest, std::abs(before) + std::abs(after));
            }
            if (random() % 2 == 0) {
                auto& [before, after] = parts[random() % samples];
                (share > 0.0 && random() % 2 == 0 ? before : after) +=
                    scale * largest * test::uniform(random, -1.0, 1.0);
            } else {
                const double theta = test::uniform(random, 0.0, std::numbers::pi);
                const double phase = test::uniform(random, 0.0, 2.0 * std::numbers::pi);
                for (std::size_t k = 0; k < samples; ++k) {
                    parts[k].second +=
                        0.3 * scale * largest * std::sin(theta * static_cast<double>(k) + phase);
                }
            }
        }
        consider(parts);
    }
    return least;
}

/// Returns bounds of a force whose slopes lie between two numbers, with a mean force.
ForceBounds bounds_of(double lower, double upper) {
    ForceBounds bounds;
    bounds.slope = {lower, upper};
    bounds.steepest = bounds.sliding = bounds.slope.largest();
    bounds.mean_force = 0.003;
    return bounds;
}

/// Returns a device with different steps and jitter, and a delay in periods.
DeviceProfile coupled_device(double delay, double encoder_step = 1e-4) {
    DeviceProfile device;
    device.period_s = 0.5e-3;
    device.jitter_s = 0.125e-3;
    device.delay_s = delay * device.period_s;
    device.encoder_step = encoder_step;
    device.force_step = 0.002;
    device.viscous_damping = 0.05;
    device.coulomb_friction = 0.01;
    return device;
}

constexpr double coupled_longest_period = 0.625e-3;

/// Expected id, sides, basis and strictness of a line.
struct Expected {
    const char* id;
    double left;
    double right;
    Basis basis = Basis::Proved;
    bool strict = false;
};

void expect_lines(const std::vector<Inequality>& lines, const std::vector<Expected>& expected) {
    ASSERT_EQ(lines.size(), expected.size());
    for (std::size_t k = 0; k < lines.size(); ++k) {
        EXPECT_EQ(lines[k].id, expected[k].id);
        EXPECT_NEAR(lines[k].left, expected[k].left, 1e-12 * std::abs(expected[k].left)) << expected[k].id;
        EXPECT_NEAR(lines[k].right, expected[k].right, 1e-12 * std::abs(expected[k].right)) << expected[k].id;
        EXPECT_EQ(lines[k].basis, expected[k].basis) << expected[k].id;
        EXPECT_EQ(lines[k].strict, expected[k].strict) << expected[k].id;
    }
}

/// Returns the damping that a coupling needs, with the need of `coupling_need`, which has its own tests.
double coupling_damping(VirtualCoupling coupling, double falling, const DeviceProfile& device) {
    return coupled_longest_period *
           coupling_need(coupling, 0.5e-3, device.whole_delay_samples(), device.delay_fraction(), falling);
}

constexpr VirtualCoupling stiff{100.0, 0.01};  // B_c / T = 20
constexpr double force_step_and_mean = 0.001 + 0.003;

template <class S>
std::vector<Inequality> coupled_lines(S structure, const ForceBounds& bounds, const DeviceProfile& device,
                                      VirtualCoupling coupling = stiff, Inertia inertia = {1e-4, 0.02}) {
    Scheme scheme;
    scheme.coupling = coupling;
    scheme.inertia = inertia;
    return inequalities(structure, bounds, scheme, device);
}

TEST(CoupledLines, OfTheMasslessStructureHaveTheSidesOfTheirFormulas) {
    for (const double delay : {0.0, 1.5}) {
        const DeviceProfile device = coupled_device(delay);
        const ForceBounds bounds = bounds_of(-30.0, 300.0);
        const double gain = massless_gain(bounds, stiff, 0.5e-3);
        expect_lines(coupled_lines(MasslessStructure{}, bounds, device),
                     {{"unique-solution", 120.0, 30.0, Basis::Proved, true},
                      {"damping-coupling", 0.05, coupling_damping(stiff, 30.0, device)},
                      {"friction-steps", 0.01, 0.5e-4 * gain + force_step_and_mean}});
        expect_lines(coupled_lines(MasslessStructure{}, bounds_of(-120.0, 1.0), device),
                     {{"unique-solution", 120.0, 120.0, Basis::Proved, true}});
        // From K_c on, nothing is known about encoder steps.
        for (const double falling : {100.0, 110.0}) {
            expect_lines(coupled_lines(MasslessStructure{}, bounds_of(-falling, 1.0), device),
                         {{"unique-solution", 120.0, falling, Basis::Proved, true},
                          {"damping-coupling", 0.05, coupling_damping(stiff, falling, device)},
                          {"encoder-step-coupling", 0.0, 1e-4, Basis::None},
                          {"friction-force-step", 0.01, force_step_and_mean}});
        }
        ForceBounds play = bounds;
        play.hysteresis = true;
        play.hysteresis_force = {-0.25, 1.0};
        for (const double damping : {0.0, 0.01}) {
            const VirtualCoupling coupling{100.0, damping};
            expect_lines(coupled_lines(MasslessStructure{}, play, device, coupling),
                         {{"loss-nonnegative", -0.25, 0.0},
                          {"unique-solution", 100.0 + 2000.0 * damping, 30.0, Basis::Proved, true},
                          {"damping-coupling", 0.05, coupling_damping(coupling, 30.0, device)},
                          {"encoder-step-coupling", 0.0, 1e-4, Basis::None},
                          {"friction-force-step", 0.01, force_step_and_mean}});
        }
    }
}

TEST(CoupledLines, WithoutCouplingDampingAreThoseOfTheForceInSeries) {
    const VirtualCoupling spring{100.0, 0.0};
    for (const double delay : {0.0, 1.0}) {
        const DeviceProfile device = coupled_device(delay);
        const double rising = 100.0 * 300.0 / 400.0;
        const double falling = 100.0 * 50.0 / 50.0;
        const std::vector<Inequality> lines =
            coupled_lines(MasslessStructure{}, bounds_of(-50.0, 300.0), device, spring);
        expect_lines(lines,
                     {{"unique-solution", 100.0, 50.0, Basis::Proved, true},
                      {"damping-hold", 0.05, coupled_longest_period * device_need(device, {rising, falling})},
                      {"friction-steps", 0.01, 0.5e-4 * 100.0 + force_step_and_mean}});
        EXPECT_TRUE(lines[1].formula.ends_with(", M and L of K_c f' / (K_c + f')"));
    }
    ForceBounds wall = bounds_of(0.0, 1.0);
    wall.slope.upper = std::numeric_limits<double>::infinity();
    EXPECT_FALSE(all_hold(coupled_lines(MasslessStructure{}, wall, coupled_device(0.0), spring)));
}

TEST(CoupledLines, OfAMassHaveTheSidesOfTheirFormulas) {
    for (const double delay : {0.0, 1.5}) {
        DeviceProfile device = coupled_device(delay);
        // m / T^2 = 400, B_o / T = 40, K_c + B_c / T = 120
        const ForceBounds bounds = bounds_of(-90.0, 5.0);
        const std::vector<Expected> no_quantisation{{"encoder-step-coupling", 0.0, 1e-4, Basis::None},
                                                    {"friction-force-step", 0.01, force_step_and_mean}};
        const auto with = [&](std::vector<Expected> lines) {
            lines.insert(lines.end(), no_quantisation.begin(), no_quantisation.end());
            return lines;
        };
        expect_lines(coupled_lines(ImplicitStructure{}, bounds, device),
                     with({{"damping-coupling", 0.05, coupling_damping(stiff, 0.0, device)},
                           {"falling-slope-limit", 80.0, 90.0, Basis::None},
                           {"unique-solution", 440.0, 90.0, Basis::Proved, true}}));
        expect_lines(coupled_lines(EnergyConsistentStructure{}, bounds, device),
                     with({{"damping-coupling", 0.05, coupling_damping(stiff, 0.0, device)},
                           {"solution-exists", 840.0, 45.0, Basis::Proved, true}}));
        ForceBounds play = bounds;
        play.hysteresis = true;
        play.hysteresis_force = {0.5, 1.0};
        EXPECT_EQ(coupled_lines(ImplicitStructure{}, play, device)[0].left, 0.5);
        EXPECT_EQ(coupled_lines(EnergyConsistentStructure{}, play, device)[0].id, "loss-nonnegative");

        device.force_limit = std::numeric_limits<double>::infinity();
        expect_lines(coupled_lines(ImplicitStructure{}, bounds, device),
                     with({{"falling-slope-coupling", 200.0, 90.0},
                           {"damping-coupling", 0.05, coupling_damping(stiff, 10.0, device)},
                           {"unique-solution", 560.0, 90.0, Basis::Proved, true}}));
        EXPECT_NEAR(coupled_lines(ImplicitStructure{}, bounds_of(-70.0, 5.0), device)[1].right,
                    coupling_damping(stiff, 0.0, device), 1e-15);
        expect_lines(coupled_lines(EnergyConsistentStructure{}, bounds, device),
                     with({{"damping-coupling", 0.05, coupling_damping(stiff, 0.0, device)},
                           {"solution-exists", 960.0, 45.0, Basis::Proved, true}}));
        // A spring has a bound of the encoder error; a force with hysteresis has none.
        ForceBounds spring = bounds_of(30.0, 30.0);
        const double gain = implicit_gain(30.0, {1e-4, 0.02}, stiff, 0.5e-3);
        expect_lines(coupled_lines(ImplicitStructure{}, spring, device),
                     {{"falling-slope-coupling", 200.0, 0.0},
                      {"damping-coupling", 0.05, coupling_damping(stiff, 0.0, device)},
                      {"unique-solution", 560.0, 0.0, Basis::Proved, true},
                      {"friction-steps", 0.01, 0.5e-4 * gain + force_step_and_mean}});
        spring.hysteresis = true;
        EXPECT_EQ(coupled_lines(ImplicitStructure{}, spring, device).size(), 6U);
    }
}

TEST(CoupledLines, NameTheDelayOnlyIfThereIsOne) {
    for (const double delay : {0.0, 0.3, 1.0}) {
        const Inequality line = detail::coupling_inequality(stiff, 0.0, coupled_device(delay));
        EXPECT_EQ(line.name, delay > 0.0 ? "viscous damping against the held and delayed coupling"
                                         : "viscous damping against the held coupling");
        EXPECT_EQ(line.formula == "b >= K_c T / 2 + B_c", delay == 0.0);
    }
    EXPECT_EQ(coupled_lines(MasslessStructure{}, bounds_of(0.0, 1.0), coupled_device(0.0))[0].formula,
              "K_c + B_c / T > s_");
    EXPECT_EQ(
        coupled_lines(MasslessStructure{}, bounds_of(0.0, 1.0), coupled_device(0.0), {100.0, 0.0})[0].formula,
        "K_c > s_");
    DeviceProfile device = coupled_device(0.0);
    EXPECT_EQ(coupled_lines(EnergyConsistentStructure{}, bounds_of(0.0, 1.0), device)[1].formula,
              "2 m / T^2 + B_o / T > s_ / 2");
    device.force_limit = std::numeric_limits<double>::infinity();
    EXPECT_EQ(coupled_lines(EnergyConsistentStructure{}, bounds_of(0.0, 1.0), device)[1].formula,
              "p > s_ / 2");
    const Inequality friction =
        coupled_lines(EnergyConsistentStructure{}, bounds_of(0.0, 1.0), device).back();
    EXPECT_EQ(friction.name, "Coulomb friction against force steps");
    EXPECT_EQ(friction.formula, "f_c >= 0 + Delta_F / 2 + |mean c(f)|");
}

TEST(CoupledLines, StiffestCouplingUsesItsShareOfTheDamping) {
    DeviceProfile device = coupled_device(0.0);
    // Without delay K_c T / 2 + B_c (T / period) = share * b.
    const double B_c = 0.01;
    for (const double share : {0.5, 0.95, 1.0}) {
        const double expected = 2.0 * (share * 0.05 - 1.25 * B_c) / coupled_longest_period;
        EXPECT_NEAR(stiffest_coupling(B_c, 0.0, device, share), expected, 1e-9 * expected);
        EXPECT_NEAR(stiffest_coupling(0.0, 0.0, device, share), 2.0 * share * 0.05 / coupled_longest_period,
                    1e-9 * 160.0);
    }
    EXPECT_EQ(stiffest_coupling(B_c, 0.0, device), stiffest_coupling(B_c, 0.0, device, 0.95));
    EXPECT_EQ(stiffest_coupling(0.05, 0.0, device), 0.0);
    // A falling slope above K_c + B_c / T has no bound for any stiffness that fits.
    EXPECT_EQ(stiffest_coupling(B_c, 200.0, device), 0.0);
    for (const double delay : {0.5, 1.0, 2.3}) {
        device = coupled_device(delay);
        const double stiffness = stiffest_coupling(0.001, 4.0, device, 0.8);
        EXPECT_LE(coupling_damping({stiffness, 0.001}, 4.0, device), 0.8 * 0.05);
        EXPECT_GT(coupling_damping({stiffness * (1.0 + 1e-9), 0.001}, 4.0, device), 0.8 * 0.05) << delay;
    }
    // A coupling much softer than 2 b / T is still found.
    device = coupled_device(0.0);
    const double nearly = 0.95 * 0.05 / 1.25 * (1.0 - 1e-6);
    EXPECT_NEAR(stiffest_coupling(nearly, 0.0, device), 152.0 * 1e-6, 1e-9);
}

TEST(CoupledAccount, OptimisedMotionsTakeNoEnergyOutOfCertifiedScenes) {
    test::Random random{41};
    int tried = 0;
    while (tried < test::cases(40, 200)) {
        CoupledScene scene = random_scene(random, random() % 3 == 0);
        if (!set_damping(scene, 1.0)) {
            continue;
        }
        ++tried;
        EXPECT_EQ(optimised(random, scene, 200), 0.0) << "scene " << tried << ": " << scene;
    }
}

// The same search finds motions that take energy out if the damping is below the bound: the bound of a held coupling
// force is exact if the object is a wall, or a spring that resonates with the coupling.
TEST(CoupledAccount, OptimisedMotionsFindEnergyBelowTheBoundOfTheHeldCoupling) {
    test::Random random{42};
    int tried = 0;
    int found = 0;
    while (tried < test::cases(60)) {
        CoupledScene scene = random_scene(random, true);
        scene.object.stiffness = 1e4;
        scene.slopes = {1e4, 1e4};
        scene.device.delay_s = 0.0;
        scene.scheme.inertia.damping = 0.0;
        if (!set_damping(scene, 0.95)) {
            continue;
        }
        ++tried;
        found += optimised(random, scene, 300) < 0.0 ? 1 : 0;
    }
    EXPECT_GE(found, tried / 2) << "of " << tried;
    RecordProperty("found", found);
}

}  // namespace
}  // namespace palpate
