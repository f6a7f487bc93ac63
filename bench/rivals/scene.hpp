// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <string_view>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/model/hysteresis.hpp"
#include "palpate/model/memory.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/stability/force_bounds.hpp"
#include "table_curve.hpp"

namespace palpate::rivals {

/// A device of the bench, with the size of its objects and the hand that holds it.
struct Device {
    std::string_view name;
    std::string_view unit;  ///< of its position, m or rad
    DeviceProfile profile;
    /// Steps of the motor controller in a period of the host; 1: the controller only holds the force.
    int controller_steps = 1;
    double travel = 0.0;          ///< travel of the objects [m or rad]
    double force = 0.0;           ///< force range of the objects [N or N*m]
    double speed = 0.0;           ///< largest speed of the hands [m/s or rad/s]
    double hand_stiffness = 0.0;  ///< stiffness of the hand [N/m or N*m/rad]
    double hand_damping = 0.0;    ///< damping of the hand [N*s/m or N*m*s/rad]
    double hand_mass = 0.0;       ///< mass of the hand [kg or kg*m^2]

    /// Returns 2 b / T, the stiffest spring that a held force renders without delay [N/m or N*m/rad].
    [[nodiscard]] double held_stiffness() const noexcept {
        return 2.0 * profile.viscous_damping / profile.period_s;
    }
};

namespace detail {

[[nodiscard]] inline DeviceProfile profile(double period_s, double inertia, double damping, double friction,
                                           double encoder_step) {
    DeviceProfile made;
    made.period_s = period_s;
    made.inertia = inertia;
    made.viscous_damping = damping;
    made.coulomb_friction = friction;
    made.encoder_step = encoder_step;
    made.force_limit = 1e9;  // no force limit, so that the stiffness search finds the limit of the method
    return made;
}

}  // namespace detail

/// The devices of the bench. The numbers of knob, arm and motor are those of the example profiles `bench-knob`,
/// `touch-x` and `moteus-r4`, without jitter, force steps and force limit. Those of the voice coil are assumed.
[[nodiscard]] inline std::vector<Device> devices() {
    return {{"bench knob", "rad", detail::profile(1e-3, 2e-4, 0.06, 0.01, 2.0 * std::numbers::pi / 65536.0),
             1, 0.5, 1.0, 10.0, 15.0, 0.05, 5e-4},
            {"desktop arm", "m", detail::profile(1e-3, 0.045, 0.02, 0.06, 2.3e-5), 1, 0.02, 3.0, 0.3, 500.0,
             2.0, 0.1},
            {"voice coil", "m", detail::profile(2.5e-4, 0.012, 1.0, 0.05, 1e-6), 1, 0.004, 1.5, 0.3, 1500.0,
             1.5, 0.01},
            {"motor", "rad", detail::profile(1e-3, 1e-4, 2e-3, 0.01, 2.0 * std::numbers::pi / 16384.0), 20,
             0.5, 0.3, 10.0, 3.0, 0.005, 1e-4}};
}

/// An object: static force, constant hysteresis of a play operator, and one branch of memory.
struct Object {
    std::string_view name;
    TableCurve force;
    double travel = 1.0;      ///< the hands move the object from 0 to this position [m or rad]
    double hysteresis = 0.0;  ///< h, half the difference between press and release force [N or N*m]
    double play_radius = 0.0;
    double branch = 0.0;           ///< stiffness of the branch [N/m or N*m/rad]
    double time_constant_s = 0.1;  ///< time constant of the branch

    [[nodiscard]] Object scaled(double factor) const {
        Object result = *this;
        result.force = force.scaled(factor);
        result.hysteresis *= factor;
        result.branch *= factor;
        return result;
    }

    /// Returns the bounds of all slopes, on which the inequalities of the certificate depend.
    [[nodiscard]] ForceBounds bounds() const {
        ForceBounds found;
        for (std::size_t k = 0; k + 1 < force.size(); ++k) {
            const double slope = force.at(force.position(k) + 0.5 * force.step()).slope;
            found.slope = {std::min(found.slope.lower, slope), std::max(found.slope.upper, slope)};
        }
        found.sliding = found.slope.largest();
        found.hysteresis = hysteresis > 0.0;
        found.hysteresis_force = {hysteresis, hysteresis};
        found.hysteresis_per_play = found.hysteresis ? hysteresis / play_radius : 0.0;
        found.slope.upper += found.hysteresis_per_play;
        found.steepest = found.sliding + found.hysteresis_per_play;
        if (branch > 0.0) {
            found.memory = MemoryBounds{.stiffness = branch, .relaxation_per_s = branch / time_constant_s};
        }
        return found;
    }
    /// Returns the steepest rising slope of a fast motion [N/m or N*m/rad].
    [[nodiscard]] double rising() const { return bounds().rising() + branch; }

    /// Returns the smallest and the largest value of `value(Curve)` over the travel.
    template <class Value>
    [[nodiscard]] Interval range_of(Value value) const {
        constexpr int parts = 1000;
        Interval range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
        for (int k = 0; k <= parts; ++k) {
            const double now = value(force.at(travel * k / parts));
            range = {std::min(range.lower, now), std::max(range.upper, now)};
        }
        return range;
    }
    [[nodiscard]] Interval forces() const {
        return range_of([](const Curve& curve) { return curve.value; });
    }
    [[nodiscard]] Interval energies() const {
        return range_of([](const Curve& curve) { return curve.integral; });
    }
    /// Returns the smallest energy over all positions [J]. Outside the table the force continues as a line.
    [[nodiscard]] double lowest_energy() const {
        double lowest = std::numeric_limits<double>::infinity();
        for (std::size_t k = 0; k < force.size(); ++k) {
            lowest = std::min(lowest, force.at(force.position(k)).integral);
        }
        for (const bool upper : {false, true}) {
            const Curve end = force.at(force.position(upper ? force.size() - 1 : 0));
            const double pull = upper ? std::max(0.0, -end.value) : std::max(0.0, end.value);
            lowest = pull > 0.0 ? std::min(lowest, end.integral - 0.5 * pull * pull / end.slope) : lowest;
        }
        return lowest;
    }

    /// Returns use(environment), with the environment of the core that renders this object once in each period.
    template <class Use>
    [[nodiscard]] AnyStructure with_environment(double period_s, Use use) const {
        const auto constant = [&](double value) {
            return TableCurve{force.position(0), force.position(force.size() - 1), {value, value}};
        };
        if (branch > 0.0) {
            MemoryParameters parameters;
            parameters.stiffness = {branch};
            parameters.time_constant_s = {time_constant_s};
            const Domain wide{{-4.0 * travel}, {4.0 * travel}, {}, {}, std::nullopt};
            const MemoryNetwork memory{parameters, NetworkCurve{{1, {}, {}, {}, {0.0}, 0.0}, wide}, wide};
            return use(MemoryForce<TableCurve>{force, constant(1.0), memory, period_s});
        }
        if (hysteresis > 0.0) {
            return use(HysteresisPair<TableCurve>{force, constant(hysteresis), play_radius});
        }
        return use(StaticForce{force});
    }
    /// Returns the held force of this object, without a method.
    [[nodiscard]] AnyStructure held(double period_s) const {
        return with_environment(
            period_s, [](auto environment) -> AnyStructure { return Direct{std::move(environment)}; });
    }
};

namespace detail {

/// Force of 1 m^-1 on a rounded corner: 0 far below, u far above.
[[nodiscard]] inline double corner(double u, double width) {
    return 0.5 * (u + std::hypot(u, width));
}
[[nodiscard]] inline double bump(double u, double width) {
    return std::exp(-u * u / (width * width));
}

[[nodiscard]] inline double wall(double u) {
    return 5.0 * corner(u - 0.8, 0.002);
}
/// Shape of a measured tactile key switch: contact, bump, preload spring, stop.
[[nodiscard]] inline double key_switch(double u) {
    return 0.25 * (corner(u, 0.01) / 1.0 + 1.0) + 0.35 * bump(u - 0.35, 0.1) + 25.0 * corner(u - 0.96, 0.02) -
           0.25;
}
[[nodiscard]] inline double dome(double u) {
    return 0.3 * u + 0.6 * bump(u - 0.4, 0.25) + 12.0 * corner(u - 0.95, 0.04);
}
[[nodiscard]] inline double tissue(double u) {
    const double inside = std::clamp(u, 0.0, 1.0);
    return 0.15 * u + 0.85 * std::expm1(4.0 * inside) / std::expm1(4.0) + 3.4 * std::max(0.0, u - 1.0);
}
[[nodiscard]] inline double detents(double u) {
    return 0.5 * std::sin(12.0 * std::numbers::pi * u);
}
/// Shape of a motor's cogging: two harmonics, mean 0.
[[nodiscard]] inline double cogging(double u) {
    return 0.35 * std::sin(16.0 * std::numbers::pi * u) + 0.2 * std::sin(32.0 * std::numbers::pi * u + 1.0);
}

}  // namespace detail

/// Shape of an object: force over its range at positions over its travel. Hysteresis and memory in the same units.
struct Shape {
    std::string_view name;
    double (*force)(double);
    double hysteresis = 0.0;
    double branch = 0.0;
};

inline constexpr std::array<Shape, 6> shapes{{{"wall", detail::wall},
                                              {"switch", detail::key_switch, 0.05, 0.0},
                                              {"dome", detail::dome},
                                              {"tissue with memory", detail::tissue, 0.0, 0.8},
                                              {"detent knob", detail::detents},
                                              {"cogging", detail::cogging}}};

/// Energy that a hand may obtain over the range of the object's energy over its travel [-].
inline constexpr double budget_share = 0.05;

/// Everything that a method may know: the device, the object, and the energy that it may give.
struct Scene {
    Device device;
    Object object;
    double budget = 0.0;  ///< energy that a hand may obtain [J]

    [[nodiscard]] const DeviceProfile& profile() const noexcept { return device.profile; }
    [[nodiscard]] double period() const noexcept { return device.profile.period_s; }
    [[nodiscard]] int delay() const noexcept { return device.profile.late_samples(); }
    /// Returns the scene with the force of the object multiplied by a factor. A softer object has a smaller budget.
    [[nodiscard]] Scene scaled(double factor) const {
        return {device, object.scaled(factor), std::min(1.0, factor) * budget};
    }
};

/// Random numbers of one draw, the same on every computer.
class Draw {
  public:
    explicit Draw(std::uint64_t seed) : bits_{seed} {}
    /// Returns a number from 0 to 1.
    [[nodiscard]] double share() { return static_cast<double>(bits_() >> 11) * 0x1p-53; }
    /// Returns a factor from 1 / largest to `largest`, evenly spaced on a logarithmic axis.
    [[nodiscard]] double factor(double largest) { return std::pow(largest, 2.0 * share() - 1.0); }

  private:
    std::mt19937_64 bits_;
};

/// Returns a scene: the device's mechanics, the hand and the object's size vary by up to 25 % between draws.
[[nodiscard]] inline Scene scene_of(Device device, const Shape& shape, int delay, Draw& draw) {
    constexpr double spread = 1.25;
    constexpr int cells = 3072;  // over three travels, from -1 to 2
    for (double* number :
         {&device.profile.viscous_damping, &device.profile.coulomb_friction, &device.profile.inertia,
          &device.travel, &device.force, &device.hand_stiffness, &device.hand_damping, &device.hand_mass}) {
        *number *= draw.factor(spread);
    }
    device.profile.delay_s = delay * device.profile.period_s;
    std::vector<double> values;
    for (int k = 0; k <= cells; ++k) {
        values.push_back(device.force * shape.force(3.0 * k / cells - 1.0));
    }
    const double play_radius = usual_play_radius(device.travel, device.profile.encoder_step);
    const Object object{shape.name,    TableCurve{-device.travel, 2.0 * device.travel, values},
                        device.travel, shape.hysteresis * device.force,
                        play_radius,   shape.branch * device.force / device.travel};
    const Interval energies = object.energies();
    return {device, object, budget_share * (energies.upper - energies.lower)};
}

}  // namespace palpate::rivals
