// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "held_lines.hpp"
#include "motions.hpp"
#include "palpate/model/limited_environment.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/make_structure.hpp"

namespace palpate::energy_search {

/// Least value of the energy V = integral of `force` over [low, high], and the position of this least value.
struct Least {
    double place = 0.0;
    double energy = 0.0;
};

template <class Force>
[[nodiscard]] Least least_energy(double low, double high, const Force& force) {
    constexpr int parts = 40000;
    const double step = (high - low) / parts;
    Least least{low, 0.0};
    double sum = 0.0;
    double before = force(low);
    for (int k = 1; k <= parts; ++k) {
        const double after = force(low + step * k);
        sum += 0.5 * (before + after) * step;
        before = after;
        if (sum < least.energy) {
            least = {low + step * k, sum};
        }
    }
    double below = least.place - step;
    double above = least.place + step;
    if (force(below) < 0.0 && force(above) > 0.0) {
        for (int k = 0; k < 60; ++k) {
            const double middle = 0.5 * (below + above);
            (force(middle) < 0.0 ? below : above) = middle;
        }
        least.place = 0.5 * (below + above);
    }
    return least;
}

/// A virtual object behind a virtual coupling, with its scheme, the device profile, and the positions at which motions
/// are tried.
struct CoupledScene {
    Scheme scheme;
    DeviceProfile device;
    Places places;
    std::string object;
    Interval slopes;
};

[[nodiscard]] inline std::string text_of(const CoupledScene& scene) {
    return scene.object + ", slope " + readable(scene.slopes.lower) + " to " + readable(scene.slopes.upper) +
           ", K_c " + readable(scene.scheme.coupling.stiffness) + ", B_c " +
           readable(scene.scheme.coupling.damping) + ", m " + readable(scene.scheme.inertia.mass) + ", B_o " +
           readable(scene.scheme.inertia.damping) + ", T " + readable(scene.device.period_s) + " + " +
           readable(scene.device.jitter_s) + ", delay " + readable(scene.device.delay_s) + ", limit " +
           readable(scene.device.force_limit);
}

/// Kinds of scenes: objects about as stiff as the coupling, objects that almost never move, or coupling forces far
/// above a force limit.
enum class Regime { Usual, Firm, Limited };

/// Returns a coupling and an inertia of about the size of the object's slopes. An object that moves little is much
/// stiffer than the coupling, or heavy.
[[nodiscard]] inline Scheme random_coupling(test::Random& random, StructureKind structure, double slope,
                                            double period, Regime regime) {
    const bool firm = regime == Regime::Firm;
    Scheme scheme;
    scheme.structure = structure;
    scheme.coupling.stiffness =
        slope * std::exp(firm && !has_mass(structure) ? test::uniform(random, -8.0, -4.0)
                                                      : test::uniform(random, -2.5, 1.5));
    scheme.coupling.damping =
        random() % 2 == 0 ? 0.0
                          : scheme.coupling.stiffness * period * std::exp(test::uniform(random, -3.0, 1.0));
    scheme.inertia.mass = scheme.coupling.stiffness * period * period *
                          std::exp(firm                        ? test::uniform(random, 9.0, 14.0)
                                   : regime == Regime::Limited ? test::uniform(random, 3.0, 8.0)
                                                               : test::uniform(random, -3.0, 7.0));
    scheme.inertia.damping =
        random() % 2 == 0 ? 0.0
                          : scheme.coupling.stiffness * period * std::exp(test::uniform(random, -3.0, 1.0));
    return scheme;
}

/// Number of motions that a trial optimises.
[[nodiscard]] inline int tried_motions() {
    return test::cases(1) > 1 ? 6 : 4;
}
/// Number of changes of each motion.
inline constexpr int changes = 60;

/// Returns a trial that optimises one motion. The trial then compares the device damping with the least damping at
/// which the motion takes no energy out.
[[nodiscard]] inline Trial motion_trial(test::Random& random, AnyStructure structure,
                                        const CoupledScene& scene, const Need& need) {
    const double period = scene.device.longest_period_s();
    auto shared = std::make_shared<AnyStructure>(std::move(structure));
    const auto seed = random();
    const auto worst = [shared, scene, seed](const auto& rate, const auto& gain) {
        test::Random own{seed};
        MotionSearch search{*shared, scene.places, scene.device.force_limit};
        return search.most(own, tried_motions(), changes, rate, gain);
    };
    struct Known {
        double friction = -1.0;
        double damping = 0.0;
    };
    auto known = std::make_shared<Known>();
    return {[=](double damping_factor, double friction_factor) {
                const double friction = friction_factor * need.friction;
                if (known->friction != friction) {
                    const double held = scene.places.held;
                    known->friction = friction;
                    known->damping =
                        period *
                        worst([&](const Account& account) { return account.damping(held, friction); },
                              [&](const Account& account) {
                                  return account.gain(need.damping / period, held, friction);
                              });
                }
                return known->damping > damping_factor * need.damping;
            },
            need, text_of(scene)};
}

/// Returns a trial that optimises one motion and compares the friction of the device with the least friction at which
/// the motion takes no energy out.
[[nodiscard]] inline Trial friction_trial(test::Random& random, AnyStructure structure,
                                          const CoupledScene& scene, const Need& need) {
    const double period = scene.device.longest_period_s();
    auto shared = std::make_shared<AnyStructure>(std::move(structure));
    struct Known {
        double damping = -1.0;
        double friction = 0.0;
    };
    auto known = std::make_shared<Known>();
    return {[=, seed = random()](double damping_factor, double friction_factor) {
                const double damping = damping_factor * need.damping / period;
                if (known->damping != damping) {
                    test::Random own{seed};
                    MotionSearch search{*shared, scene.places, scene.device.force_limit};
                    const auto rate = [&](const Account& account) {
                        return account.gain(damping, scene.places.held, 0.0);
                    };
                    known->damping = damping;
                    known->friction = search.most(own, tried_motions(), changes, rate, rate);
                }
                return known->friction > friction_factor * need.friction;
            },
            need, text_of(scene)};
}

/// Returns an object whose force consists of straight pieces and whose stored energy is finite.
[[nodiscard]] inline Pieces closed_pieces(test::Random& random, int count, double step, Slopes slopes) {
    std::vector<double> forces = random_forces(random, count, step, slopes);
    const double steepest = std::max(slopes.M, slopes.s);
    while (forces.back() <= 0.0) {
        forces.push_back(forces.back() + steepest * step);
    }
    int before = 0;
    while (forces.front() >= 0.0) {
        forces.insert(forces.begin(), forces.front() - steepest * step);
        ++before;
    }
    return {-step * before, step, forces};
}

[[nodiscard]] inline std::optional<Trial> draw_coupled(test::Random& random, StructureKind kind, double delay,
                                                       Regime regime) {
    const bool network = regime != Regime::Limited && random() % 3 == 0;
    const bool hysteresis = random() % 3 == 0;
    CoupledScene scene;
    scene.device = random_device(random, delay);
    scene.places.delay = scene.device.whole_delay_samples();
    scene.places.late = scene.device.delay_fraction();
    scene.object = std::string(network ? "wavelets" : "pieces") + (hysteresis ? " with hysteresis" : "");
    const auto certified = [&](const auto& object) {
        return certified_need(scene.device, [&](const DeviceProfile& generous) {
            return certify(object, scene.scheme, generous);
        });
    };
    const auto placed = [&](double low, double high, double step, double slope, const auto& force) {
        // For an object without mass, the force limit of the device also limits the force of the object.
        const double limit = has_mass(kind) ? 1e300 : scene.device.force_limit;
        const Least least = least_energy(low - 5.0 * (high - low), high + 5.0 * (high - low),
                                         [&](double x) { return std::clamp(force(x), -limit, limit); });
        scene.places.start = least.place;
        scene.places.low = low;
        scene.places.high = high;
        scene.places.finest = 1e-2 * step;
        scene.places.widest = 3.0 * (high - low) * std::max(1.0, slope / scene.scheme.coupling.stiffness);
        if (regime == Regime::Limited) {
            scene.places.widest = 40.0 * scene.device.force_limit / scene.scheme.coupling.stiffness;
        }
    };
    if (network) {
        const ForceModel model = hysteresis ? small_hysteresis(random, test::uniform(random, 0.005, 0.05))
                                            : ForceModel{small_network(random), test::unit_domain()};
        const double slope = std::max(1.0, model.slope_bounds().largest());
        limit_by(random, scene.device, slope * test::uniform(random, 0.05, 0.5));
        scene.scheme = random_coupling(random, kind, slope, scene.device.period_s, regime);
        const auto need = certified(model);
        scene.slopes = force_bounds(model).slope;
        if (!need || need->damping <= 0.0) {
            return std::nullopt;
        }
        const NetworkCurve& curve = hysteresis ? model.hysteresis()->force() : model.network()->curve();
        placed(0.0, 1.0, model.finest_width(), slope, [&](double x) { return curve.at(x).value; });
        return motion_trial(
            random, make_structure(model, scene.scheme, scene.device.period_s, scene.device.force_limit),
            scene, *need);
    }
    const int count = 12;
    const double step = std::exp(test::uniform(random, -6.0, -2.0));
    const Slopes slopes = random_slopes(random);
    const Pieces g = closed_pieces(random, count, step, slopes);
    scene.scheme = random_coupling(random, kind, std::max(slopes.M, slopes.s), scene.device.period_s, regime);
    if (regime == Regime::Limited) {
        scene.device.force_limit = largest_of(g.points()) * test::uniform(random, 0.2, 2.0);
    } else {
        limit_by(random, scene.device, largest_of(g.points()));
    }
    if (scene.device.force_limit > 1e8) {
        scene.device.force_limit = std::numeric_limits<double>::infinity();
    }
    const double period = scene.device.period_s;
    placed(0.0, step * count, step, std::max(slopes.M, slopes.s), [&](double x) { return g.at(x).value; });
    const auto build = [&](const auto& object, const ForceBounds& bounds) -> std::optional<Trial> {
        const auto need = certified(bounds);
        scene.slopes = bounds.slope;
        if (!need || need->damping <= 0.0) {
            return std::nullopt;
        }
        const auto run = [&](AnyStructure structure) -> std::optional<Trial> {
            return motion_trial(random, std::move(structure), scene, *need);
        };
        const double limit = scene.device.force_limit;
        switch (kind) {
            case StructureKind::Massless:
                return run(Massless{LimitedEnvironment{object, limit}, scene.scheme.coupling, period});
            case StructureKind::Implicit:
                return run(Implicit{object, scene.scheme.inertia, scene.scheme.coupling, period,
                                    LoadLineSolver{}, limit});
            default:
                return run(EnergyConsistent{object, scene.scheme.inertia, scene.scheme.coupling, period,
                                            1e-3 * step, true, limit});
        }
    };
    if (hysteresis) {
        std::vector<double> h(g.points().size(), 0.2 * largest_of(g.points()));
        const HysteresisPair<Pieces> pair{g, Pieces{0.0, step, h}, step * test::uniform(random, 0.3, 3.0)};
        return build(pair, bounds_of(pair));
    }
    return build(PieceObject{g}, bounds_of(g));
}

/// Makes a scene of an encoder with steps and a virtual coupling; the virtual objects are massless, or springs with
/// mass.
[[nodiscard]] inline std::optional<Trial> draw_coupled_encoder(test::Random& random, double delay,
                                                               bool mass) {
    CoupledScene scene;
    const StructureKind kind = mass ? StructureKind::Implicit : StructureKind::Massless;
    scene.device = random_device(random, delay);
    scene.device.force_limit = std::numeric_limits<double>::infinity();
    scene.places.delay = scene.device.whole_delay_samples();
    scene.places.late = scene.device.delay_fraction();
    const double period = scene.device.period_s;
    const int count = 12;
    const double step = std::exp(test::uniform(random, -6.0, -2.0));
    const Slopes slopes = random_slopes(random);
    const double slope = std::max(slopes.M, slopes.s);
    const Pieces g = closed_pieces(random, count, step, slopes);
    scene.scheme = random_coupling(random, kind, slope, period, Regime::Usual);
    scene.device.encoder_step = scene.places.encoder_step = step * std::exp(test::uniform(random, -2.0, 1.0));
    const auto force = [&](double x) { return mass ? slope * x : g.at(x).value; };
    const Least least = least_energy(-5.0 * step * count, 6.0 * step * count, force);
    const double start = scene.places.encoder_step * std::round(least.place / scene.places.encoder_step);
    constexpr int parts = 1000;
    for (int k = 0; k < parts; ++k) {
        scene.places.held +=
            force(least.place + (start - least.place) * (k + 0.5) / parts) * (start - least.place) / parts;
    }
    scene.places.held += 1e-6 * std::abs(scene.places.held);
    scene.places.start = start;
    scene.places.high = step * count;
    scene.places.finest = 0.3 * scene.places.encoder_step;
    scene.places.widest = 10.0 * scene.places.encoder_step;
    ForceBounds bounds = bounds_of(g);
    if (mass) {
        bounds = {};
        bounds.slope = {slope, slope};
        bounds.steepest = bounds.sliding = slope;
    }
    scene.slopes = bounds.slope;
    const auto need = certified_need(
        scene.device, [&](const DeviceProfile& generous) { return certify(bounds, scene.scheme, generous); });
    if (!need || need->damping <= 0.0 || need->friction <= 0.0) {
        return std::nullopt;
    }
    if (mass) {
        return friction_trial(
            random, Implicit{test::Spring{slope}, scene.scheme.inertia, scene.scheme.coupling, period}, scene,
            *need);
    }
    return friction_trial(random, Massless{PieceObject{g}, scene.scheme.coupling, period}, scene, *need);
}

/// Makes a force with hysteresis that is computed at a predicted position. The play operator follows the measured
/// position.
[[nodiscard]] inline std::optional<Trial> draw_predicted_hysteresis(test::Random& random, double delay) {
    CoupledScene scene;
    scene.scheme.structure = StructureKind::Direct;
    scene.scheme.predict = 1 + static_cast<int>(random() % 4);
    scene.device = random_device(random, delay);
    scene.places.delay = scene.device.whole_delay_samples();
    scene.places.late = scene.device.delay_fraction();
    const int count = 12;
    const double step = std::exp(test::uniform(random, -6.0, -2.0));
    const Pieces g = closed_pieces(random, count, step, random_slopes(random));
    const std::vector<double> h(g.points().size(), largest_of(g.points()) * test::uniform(random, 0.0, 1.0));
    const HysteresisPair<Pieces> pair{g, Pieces{g.from(), step, h}, step * test::uniform(random, 0.3, 6.0)};
    limit_by(random, scene.device, largest_of(g.points()));
    const ForceBounds bounds = bounds_of(pair);
    scene.slopes = bounds.slope;
    const auto need = certified_need(
        scene.device, [&](const DeviceProfile& generous) { return certify(bounds, scene.scheme, generous); });
    if (!need || need->damping <= 0.0) {
        return std::nullopt;
    }
    const Least least = least_energy(-5.0 * step * count, 6.0 * step * count,
                                     [&](double x) { return clipped(g.at(x).value, scene.device); });
    scene.places.start = least.place;
    scene.places.high = step * count;
    scene.places.finest = 1e-2 * step;
    scene.places.widest = 3.0 * step * count;
    return motion_trial(random, PredictedDirect{pair, scene.scheme.predict}, scene, *need);
}

}  // namespace palpate::energy_search
