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

TEST(CoupledAccount, OptimisedMotionsTakeNoEnergyOutOfCertifiedScenes) {
    test::Random random{41};
    int tried = 0;
    while (tried < test::cases(200)) {
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
