// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <ostream>
#include <vector>

#include "palpate/guard/energy_account.hpp"
#include "support.hpp"

// Hands that take energy out of renderings for which nothing is proved, limited by an energy account. The energy is
// summed from the true motion, without a function of the account.

namespace palpate::bench {

/// A device, its stated numbers and an object without any property.
struct AccountScene {
    AccountSettings settings;      ///< the account counts exactly the losses of the device
    double force_limit = 0.0;      ///< [N]
    double stiffness = 0.0;        ///< of a spring or wall [N/m]
    std::uint64_t object = 0;      ///< spring, wall, random force, force that changes its sign in each tick
    std::uint64_t hand = 0;        ///< kind of motion
    double reach = 0.0;            ///< size of motions that do not follow the force [m]
    double share = 1.0;            ///< motion of a greedy hand / motion that takes most energy
    double unread = 0.0;           ///< share of ticks without a valid reading
    bool arbitrary_error = false;  ///< true: the error of a reading is any number up to half an encoder step

    friend std::ostream& operator<<(std::ostream& out, const AccountScene& scene) {
        const AccountSettings& of = scene.settings;
        return out << "E0 " << of.stored.within << ", b " << of.device_damping << ", f_c "
                   << of.device_friction << ", Delta " << of.encoder_step << ", Delta_F " << of.force_step
                   << ", delay " << of.whole_delay + of.delay_fraction << ", longest step " << of.longest_step
                   << ", T " << of.period_s << ", object " << scene.object << ", hand " << scene.hand
                   << ", unread " << scene.unread;
    }
};

[[nodiscard]] inline AccountScene random_account_scene(test::Random& random) {
    const auto log_uniform = [&](double low, double high) {
        return std::exp(test::uniform(random, std::log(low), std::log(high)));
    };
    const auto maybe = [&](double value) { return random() % 2 == 0 ? value : 0.0; };
    AccountScene scene;
    AccountSettings& of = scene.settings;
    of.period_s = std::array{1e-3, 2.5e-4, 1e-4}[random() % 3];
    of.stored.within = log_uniform(1e-5, 1e-2);
    of.device_damping = random() % 10 == 0 ? 0.0 : log_uniform(0.02, 2.0);
    of.device_friction = maybe(log_uniform(0.01, 0.5));
    of.encoder_step = maybe(log_uniform(1e-7, 3e-5));
    of.force_step = maybe(log_uniform(1e-3, 1e-1));
    if (of.device_damping == 0.0 || random() % 2 == 0) {
        of.longest_step = log_uniform(0.03, 3.0) * of.period_s + of.encoder_step;
    }
    of.whole_delay = static_cast<int>(random() % 3);
    of.delay_fraction = maybe(test::uniform(random, 0.01, 0.99));
    scene.force_limit = log_uniform(0.3, 10.0);
    const double damping = std::max(of.device_damping, 0.02) / of.period_s;
    scene.stiffness = damping * log_uniform(0.5, 200.0);
    scene.object = random() % 4;
    scene.hand = random() % 6;
    scene.reach = log_uniform(1e-7, 3e-3);
    scene.share = random() % 2 == 0 ? 1.0 : test::uniform(random, 0.1, 1.0);
    scene.unread = random() % 4 == 0 ? log_uniform(1e-3, 0.2) : 0.0;
    scene.arbitrary_error = random() % 2 == 0;
    return scene;
}

/// Energy of a motion in the periods between two valid readings. It ends with the first tick in which it is far below
/// -E0.
struct AccountMotion {
    double deepest = 0.0;     ///< least energy that the hand has put in, divided by E0 [-]
    std::size_t limited = 0;  ///< ticks in which the account limited the force
};

/// Moves the handle of a scene and sums the energy that the hand puts in. Every motion is possible: within each part of
/// a period with constant force the handle moves at constant speed, at most the largest one.
[[nodiscard]] inline AccountMotion move_account(const AccountScene& scene, test::Random& random, int ticks) {
    const AccountSettings& of = scene.settings;
    EnergyAccount account{of};
    const double damping = of.device_damping / of.period_s;
    const double start = test::uniform(random, -1e-3, 1e-3);
    double x = start;
    double energy = 0.0;
    double at_reading = 0.0;                                   // energy at the last valid reading
    bool counts = true;                                        // the last reading had a force
    double before = std::numeric_limits<double>::quiet_NaN();  // last valid reading
    std::vector<double> commands(static_cast<std::size_t>(of.whole_delay) + 2, 0.0);
    double applied = 0.0;
    AccountMotion result;
    const auto move = [&](double wanted, double force, double part) {
        const double longest = part * of.longest_step;
        const double moved = std::clamp(wanted, -longest, longest);
        x += moved;
        energy += force * moved + of.device_friction * std::abs(moved) +
                  (part > 0.0 ? damping * moved * moved / part : 0.0);
        result.deepest = std::min(result.deepest, energy / of.stored.within);
    };
    const auto wanted = [&](double force, double part, int tick) {
        const double above = std::max(0.0, std::abs(force) - of.device_friction);
        const double best = damping > 0.0 ? 0.5 * above / damping : of.longest_step;
        const double greedy = -std::copysign(above > 0.0 ? scene.share * part * best : 0.0, force);
        const double aim = start + scene.reach * std::sin(0.01 * tick);
        switch (scene.hand) {
            case 0:
                return scene.reach * test::uniform(random, -1.0, 1.0);
            case 1:
                return part * scene.reach * (tick % 2 == 0 ? 1.0 : -1.0);
            case 2:
                return greedy;
            case 3:
                return random() % 4 == 0 ? scene.reach * test::uniform(random, -1.0, 1.0) : greedy;
            case 4:  // presses slowly, then takes energy
                return tick % 200 < 150 ? part * (aim - x) : greedy;
            default:  // moves by encoder steps between greedy ticks
                return tick % 3 == 0 ? of.encoder_step * test::uniform(random, -1.5, 1.5) : greedy;
        }
    };
    for (int tick = 0; tick < ticks && result.deepest >= -1.5; ++tick) {
        const double error =
            scene.arbitrary_error   ? 0.5 * of.encoder_step *
                                          (random() % 2 == 0 ? test::uniform(random, -1.0, 1.0)
                                                             : (random() % 2 == 0 ? 1.0 : -1.0))
            : of.encoder_step > 0.0 ? of.encoder_step * std::floor(x / of.encoder_step + 0.5) - x
                                    : 0.0;
        const double reading = x + error;
        double force = 0.0;
        const bool has_force = scene.unread == 0.0 || random() % 1000 != 0;
        if (test::uniform(random, 0.0, 1.0) < scene.unread) {
            account.interrupt();
            energy = at_reading;  // a period without a reading at both ends does not count
            before = std::numeric_limits<double>::quiet_NaN();
        } else {
            account.visit(reading, reading);
            account.book(has_force ? applied : std::numeric_limits<double>::quiet_NaN(), reading - before);
            energy = counts && has_force && !std::isnan(before) ? energy : at_reading;
            counts = has_force;
            before = reading;
            at_reading = energy;
            const double spring = scene.stiffness * (reading - start);
            const double any = scene.force_limit * test::uniform(random, -1.0, 1.0);
            force = std::array{spring, std::max(0.0, spring), any,
                               tick % 2 == 0 ? scene.force_limit : -scene.force_limit}[scene.object];
            force = std::clamp(force, -scene.force_limit, scene.force_limit);
            result.limited += account.apply(force) == Status::EnergyLimited ? 1 : 0;
        }
        account.sent(force);
        const double rounded =
            of.force_step > 0.0 ? of.force_step * std::round(force / of.force_step) : force;
        commands.insert(commands.begin(), rounded);
        commands.pop_back();
        const double earlier = commands[static_cast<std::size_t>(of.whole_delay) + 1];
        applied = commands[static_cast<std::size_t>(of.whole_delay)];
        if (of.delay_fraction > 0.0) {
            move(wanted(earlier, of.delay_fraction, tick), earlier, of.delay_fraction);
        }
        move(wanted(applied, 1.0 - of.delay_fraction, tick), applied, 1.0 - of.delay_fraction);
    }
    return result;
}

}  // namespace palpate::bench
