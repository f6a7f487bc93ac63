// SPDX-License-Identifier: Apache-2.0
// Tests that each guard acts on the fault for which it is made, and does not act without this fault.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "limits/hands.hpp"
#include "palpate/device/device.hpp"
#include "palpate/device/device_profile.hpp"
#include "palpate/guard/guards.hpp"
#include "palpate/model/energy.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/run/controller.hpp"
#include "palpate/simulation/closed_loop.hpp"
#include "palpate/stability/certificate.hpp"
#include "simulation/scenes.hpp"
#include "support.hpp"

namespace palpate {
namespace {

constexpr double period = 1e-3;

ForceModel wall(double stiffness) {
    return {NetworkParameters{1, {}, {}, {}, {stiffness}, 0.0},
            {{0.0}, {0.1}, Continuation::Linear, Continuation::Linear, std::nullopt}};
}

GuardSettings settings_for(const DeviceProfile& device) {
    GuardSettings settings;
    settings.slew_s = settings.ramp_s = 0.0;
    use_device(settings, device);
    return settings;
}

struct Guarded {
    std::vector<double> forces;
    std::size_t energy_limited = 0;
    std::size_t limit_cycle_scaled = 0;
    EnergyBalance energy;
};

template <SimulatedHand H>
Guarded render(const ForceModel& model, const DeviceProfile& device, const Guards& guards, H hand,
               std::size_t ticks, double start) {
    Guarded run;
    const auto watch = [&](const Tick& tick, const Motion& /*handle*/, const EnergyBalance& /*account*/) {
        run.forces.push_back(tick.command.force);
        run.energy_limited += tick.status == Status::EnergyLimited ? 1 : 0;
        run.limit_cycle_scaled += tick.status == Status::LimitCycleScaled ? 1 : 0;
        return true;
    };
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    run.energy = closed_loop(make_structure(model, scheme, device.period_s, device.force_limit), device, hand,
                             ticks, {20, start, 0.0, guards}, watch)
                     .energy;
    return run;
}

Scheme direct() {
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    return scheme;
}

// In the click-and-wall scene, on a device with encoder steps and without friction, the guards do not change the force.
TEST(Guards, DoNotChangeForcesOfTheComparisonScene) {
    const test::ClickAndWall object;
    double held = 0.0;
    for (double x = 0.0; x < 0.5; x += 1e-5) {
        held += object.at(x, {}).force * 1e-5;
    }
    const DeviceProfile device;
    Guards guards = guards_of(settings_for(device), wall(60.0), direct(), period);
    AccountSettings account = account_settings(settings_for(device), period);
    account.stored.within = held;
    guards.account = EnergyAccount{account};
    const auto forces = [&](const Guards& used) {
        SimulatedDevice knob{device};
        EXPECT_TRUE(knob.open());
        Controller controller{knob, Direct{object}, used};
        EXPECT_EQ(controller.start(), Status::Ok);
        std::vector<double> sent;
        for (int k = 0; k < 4000; ++k) {
            const Tick tick = controller.tick();
            EXPECT_EQ(tick.status, Status::Ok);
            sent.push_back(tick.command.force);
        }
        return sent;
    };
    EXPECT_EQ(forces(guards), forces(Guards{}));
}

TEST(Guards, DoNotChangeForcesOfCertifiedScenes) {
    test::Random random{3};
    for (int k = 0; k < test::cases(60); ++k) {
        test::Scene scene = test::random_certified_scene(random, 1.25);
        scene.device.force_limit = 1e9;
        GuardSettings settings = settings_for(scene.device);
        settings.limit_cycle_force = 0.01;
        settings.certified = true;
        Guards guards = guards_of(settings, scene.model, scene.scheme, scene.device.period_s);
        guards.reading = {};
        std::size_t acted = 0;
        const Hand hand{50.0, 0.05, 0.1, 0.9, test::uniform(random, 0.5, 8.0)};
        (void)closed_loop(
            make_structure(scene.model, scene.scheme, scene.device.period_s, scene.device.force_limit),
            scene.device, hand, 1000, {8, 0.1, 0.0, guards},
            [&](const Tick& tick, const Motion& /*handle*/, const EnergyBalance& /*account*/) {
                acted += tick.status == Status::EnergyLimited || tick.status == Status::LimitCycleScaled;
                return true;
            });
        EXPECT_EQ(acted, 0U) << scene;
    }
}

TEST(EnergyAccount, AHandTakesAtMostTheEnergyOfTheObject) {
    test::Random random{9};
    for (int k = 0; k < test::cases(50); ++k) {
        DeviceProfile device;
        device.encoder_step = 0.0;
        device.delay_s = static_cast<double>(random() % 3) * device.period_s;
        const double stiffness = test::uniform(random, 1.5, 8.0) * 2.0 * device.viscous_damping / period;
        const ForceModel model = wall(stiffness);
        GuardSettings settings = settings_for(device);
        settings.limit_cycle_force = 0.0;
        const double held = largest_stored_energy(model, direct(), device.force_limit);
        const auto lost = [&](bool account) {
            settings.energy_account = account;
            const Guarded run = render(model, device, guards_of(settings, model, direct(), period),
                                       PassiveHand{15.0, 0.0, 0.0, 0.1}, 5000, 0.02);
            // Energy that the motor gave to the handle, minus nine tenths of the energy that damping and friction of
            // the device dissipated.
            return -(run.energy.motor + 0.9 * run.energy.dissipated);
        };
        EXPECT_LT(lost(true), (1.0 + 1e-9) * held) << stiffness << " delay " << device.late_samples();
        EXPECT_GT(lost(false), 2.0 * held) << stiffness << " delay " << device.late_samples();
    }
}

TEST(StoredEnergy, GrowsWithTheVisitedPositions) {
    StoredEnergy stored{{.within = 1.0,
                         .lower = 0.0,
                         .upper = 1.0,
                         .force_limit = 5.0,
                         .stiffness = 50.0,
                         .mass = 0.02,
                         .period_s = period}};
    stored.visit(0.5, 0.45);
    EXPECT_EQ(stored.most(), 1.0);
    stored.visit(0.51, 0.46);
    EXPECT_NEAR(stored.most(), 1.0 + 0.5 * 0.02 * 10.0 * 10.0, 1e-9);
    stored.visit(-0.3, -0.2);
    EXPECT_NEAR(stored.most(), 1.0 + 5.0 * 0.3 + 0.5 * 0.02 * 660.0 * 660.0, 1e-6);
    stored = StoredEnergy{{.within = 1.0, .force_limit = 5.0, .stiffness = 50.0}};
    stored.visit(0.0, 0.4);  // stretches the coupling by 0.3 more than the force limit of the device does
    EXPECT_NEAR(stored.most(), 1.0 + 5.0 * 0.3, 1e-12);
    stored = StoredEnergy{{.within = 1.0, .force_limit = 5.0, .stiffness = 50.0, .included_stretch = 0.02}};
    stored.visit(0.0, 0.06);
    EXPECT_NEAR(stored.most(), 1.0 + 25.0 * (0.06 * 0.06 - 0.02 * 0.02), 1e-12);
    stored.visit(0.0, 0.4);
    EXPECT_NEAR(stored.most(), 1.0 + 25.0 * (0.1 * 0.1 - 0.02 * 0.02) + 5.0 * 0.3, 1e-12);
}

TEST(ReadMotion, MovesTheLeastDistanceThatReadingsProve) {
    test::Random random{4};
    for (int k = 0; k < test::cases(200); ++k) {
        const double step = std::exp(test::uniform(random, -6.0, 0.0));
        ReadMotion motion{step};
        double at = test::uniform(random, -1.0, 1.0);
        double true_distance = 0.0;
        double read_distance = 0.0;
        const double reach = step * std::exp(test::uniform(random, -3.0, 2.0));
        (void)motion.to(step * std::round(at / step));
        for (int tick = 0; tick < 500; ++tick) {
            const double moved = reach * test::uniform(random, -1.0, 1.0);
            at += moved;
            true_distance += std::abs(moved);
            read_distance += std::abs(motion.to(step * std::round(at / step)));
            ASSERT_LE(read_distance, true_distance + 0.5 * step + 1e-12);
        }
    }
    ReadMotion motion{1.0};
    EXPECT_TRUE(std::isnan(motion.to(3.0)));
    EXPECT_EQ(motion.to(4.0), 0.5);
    EXPECT_EQ(motion.to(3.0), 0.0);
    EXPECT_EQ(motion.to(2.0), -1.0);
    motion.interrupt();
    EXPECT_TRUE(std::isnan(motion.to(7.0)));
}

TEST(LargestStoredEnergy, IsThatOfTheModelAndItsCoupling) {
    const ForceModel model = wall(100.0);
    EXPECT_NEAR(largest_stored_energy(model, direct(), 20.0), 0.5, 1e-6);
    EXPECT_NEAR(largest_stored_energy(model, direct(), 5.0), 0.125 + 0.25, 1e-6);  // force limited to 5
    Scheme coupled;
    coupled.coupling.stiffness = 50.0;
    EXPECT_NEAR(largest_stored_energy(model, coupled, 5.0), 0.375 + 0.5 * 25.0 / 50.0, 1e-6);
    coupled.compensated = true;
    EXPECT_NEAR(largest_stored_energy(model, coupled, 5.0), 0.375 + 25.0 / 50.0, 1e-6);
    const ForceModel motor{NetworkParameters{1, {}, {}, {}, {0.0}, 1.0}, {{0.0}, {1.0}, {}, {}, 1.0}};
    EXPECT_TRUE(std::isinf(largest_stored_energy(motor, direct(), 5.0)));
}

// Without encoder steps, the energy account of the passivity observer equals the account of the simulation.
TEST(PassivityObserver, MeasuresTheEnergyOfTheMotor) {
    DeviceProfile device;
    device.encoder_step = 0.0;
    device.delay_s = device.period_s;
    SimulatedHandle<GreedyHand, Midpoint> handle{device, {10.0, 0.05, 0.03, 0.5}, 20, 0.1};
    ASSERT_TRUE(handle.open());
    Controller controller{handle, Direct{test::Spring{30.0}}, Guards{}};
    ASSERT_EQ(controller.start(), Status::Ok);
    for (int k = 0; k < 500; ++k) {
        const double before = handle.plant().account().motor;
        (void)controller.tick();
        EXPECT_NEAR(controller.guards().observer.energy(), before, 1e-12);
    }
    EXPECT_LT(controller.guards().observer.least(), 0.0);
}

struct Watched {
    LimitCycleDetector detector{LimitCycleSettings{0.05, 25, 1e-4}};

    void shake(double frequency_hz, double amplitude, double decay, int ticks, double drift = 0.0) {
        for (int k = 0; k < ticks; ++k) {
            const double swing =
                amplitude * std::exp(-decay * k) * std::sin(6.283185307 * frequency_hz * k * period);
            detector.watch(drift * k + swing, 100.0 * swing);
        }
    }
};

TEST(LimitCycleDetector, DetectsALimitCycleAndScalesForcesDown) {
    for (const double frequency : {30.0, 120.0, 333.0, 499.0}) {
        Watched shaken;
        shaken.shake(frequency, 2e-3, 0.0, 1000);
        EXPECT_GE(shaken.detector.limit_cycles(), 1U) << frequency;
        EXPECT_NEAR(shaken.detector.scale(), std::pow(0.7, shaken.detector.limit_cycles()), 1e-12);
    }
}

TEST(LimitCycleDetector, IgnoresOtherMotions) {
    Watched slow;
    slow.shake(12.0, 2e-2, 0.0, 4000);
    EXPECT_EQ(slow.detector.limit_cycles(), 0U);
    Watched decaying;
    decaying.shake(100.0, 2e-2, 0.015, 4000);
    EXPECT_EQ(decaying.detector.limit_cycles(), 0U);
    Watched faint;
    faint.shake(100.0, 1e-4, 0.0, 4000);
    EXPECT_EQ(faint.detector.limit_cycles(), 0U);
    Watched turning;  // the force oscillates as detents pass, but the knob never reverses
    turning.shake(100.0, 2e-3, 0.0, 4000, 2e-3);
    EXPECT_EQ(turning.detector.limit_cycles(), 0U);
}

TEST(LimitCycleDetector, StopsALimitCycleAtAWallAndReportsIt) {
    const DeviceProfile device;
    const ForceModel model = wall(5.0 * 2.0 * device.viscous_damping / period);
    GuardSettings settings = settings_for(device);
    settings.energy_account = false;
    const auto swing = [&](double limit_cycle_force) {
        settings.limit_cycle_force = limit_cycle_force;
        Guarded run = render(model, device, guards_of(settings, model, direct(), period),
                             PassiveHand{15.0, 0.0, 0.0, 0.1}, 3000, 0.0);
        const auto [low, high] = std::minmax_element(run.forces.end() - 500, run.forces.end());
        return std::pair{*high - *low, run.limit_cycle_scaled};
    };
    EXPECT_GT(swing(0.0).first, 5.0);
    EXPECT_EQ(swing(0.0).second, 0U);
    EXPECT_LT(swing(0.05).first, 0.2);
    EXPECT_GT(swing(0.05).second, 1000U);
}

TEST(GuardSettings, RefusesInvalidValues) {
    for (double GuardSettings::* field : {&GuardSettings::limit_cycle_force, &GuardSettings::device_damping,
                                          &GuardSettings::device_friction, &GuardSettings::encoder_step}) {
        GuardSettings settings;
        settings.*field = -1.0;
        EXPECT_THROW(validate(settings), std::invalid_argument);
        settings.*field = std::nan("");
        EXPECT_THROW(validate(settings), std::invalid_argument);
    }
}

// Tests the energy with all guards active. A handle with a prescribed motion keeps an independent energy account from
// the acting force, the true motion, and the losses by damping and friction.

/// A device whose handle follows positions given by the test, at constant speed within each tick.
class GuidedHandle {
  public:
    GuidedHandle(DeviceProfile device, double start) : device_{std::move(device)}, at_{start}, to_{start} {}

    [[nodiscard]] static Opened open() { return {}; }
    static void close() noexcept {}
    void move_to(double position) noexcept { to_ = position; }

    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        const auto delay = static_cast<std::size_t>(device_.whole_delay_samples());
        const double step = device_.force_step;
        pending_[(ticks_ + delay) % pending_.size()] =
            step > 0.0 ? step * std::round(command.force / step) : command.force;
        const double force = pending_[ticks_ % pending_.size()];
        const double way = to_ - at_;
        motor_ += force * way;
        dissipated_ += std::abs(way) * (device_.viscous_damping * std::abs(way) / device_.period_s +
                                        device_.coulomb_friction);
        least_ = std::min(least_, energy());
        at_ = to_;
        ++ticks_;
        return {encoded(at_),
                0.0,
                force,
                std::numeric_limits<double>::quiet_NaN(),
                static_cast<double>(ticks_) * device_.period_s,
                ticks_,
                Status::Ok};
    }

    /// `energy` returns the energy that the hand has put in; `least` returns the least value of this energy so far [J].
    [[nodiscard]] double energy() const noexcept { return motor_ + dissipated_; }
    [[nodiscard]] double least() const noexcept { return least_; }
    [[nodiscard]] double motor() const noexcept { return motor_; }
    void begin_account() noexcept { motor_ = dissipated_ = least_ = 0.0; }

  private:
    [[nodiscard]] double encoded(double position) const noexcept {
        const double step = device_.encoder_step;
        return step > 0.0 ? step * std::floor(position / step + 0.5) : position;
    }

    DeviceProfile device_;
    double at_;
    double to_;
    double motor_ = 0.0;
    double dissipated_ = 0.0;
    double least_ = 0.0;
    std::uint64_t ticks_ = 0;
    std::array<double, longest_delay_samples + 2> pending_{};
};

/// Returns the `bench-knob` device profile of the package.
DeviceProfile bench_knob() {
    DeviceProfile device;
    device.id = "bench-knob";
    device.jitter_s = 2e-4;
    device.coulomb_friction = 0.01;
    return device;
}

/// Returns the identified model of the README example, as `palpate demo` and `palpate identify` make it.
ForceModel readme_knob() {
    NetworkParameters network;
    network.alpha = {14.065144146110542, 4.162057332442819, 5.888611543700749, 36.06654311080214,
                     6.664738379356768,  41.52923490349144, 56.94283014365128};
    network.beta = {0.5078861161881123,   0.6697168372310223, 0.2474086359804909, 0.3957300688865673,
                    0.028856055274948916, 0.3459005107773592, 0.3611594362786021};
    network.weight = {-1.676664574504042,   -5.438124858723128,   -1.0018247819200101, 0.18985264042413774,
                      -0.25599214321014574, 0.033236368235800215, 0.022776608906540038};
    network.linear = {4.599103438500333};
    network.bias = 0.9042297017519991;
    return {network,
            {{-0.19999274522059046}, {0.46901462589603476}, Continuation::Linear, Continuation::Linear, {}}};
}

/// Returns the guards of a run with a certificate, or without one.
Guards certified_guards(const ForceModel& model, const Scheme& scheme, const DeviceProfile& device,
                        bool certified = true) {
    GuardSettings settings;
    use_device(settings, device);
    settings.slew_s = 0.0;
    settings.certified = certified;
    settings.largest_speed = 1e9;
    settings.frozen_s = 0.0;
    return guards_of(settings, model, scheme, device.period_s);
}

struct Pressed {
    std::size_t energy_limited = 0;
    std::size_t limit_cycle_scaled = 0;
    /// Least value, since the end of the start ramp, of the energy that the hand has put in [J]
    double least = 0.0;
    std::uint64_t ticks = 0;
};

/// Presses the README example from below its click into its wall and moves back. One press in 50 is ten times slower,
/// one in 1000 is a hundred times slower.
Pressed press_readme_knob(int presses) {
    const DeviceProfile device = bench_knob();
    const ForceModel model = readme_knob();
    EXPECT_TRUE(certify(model, direct(), device).certified());
    const double released = 0.2;
    GuidedHandle handle{device, released};
    Controller controller{handle, Direct{CompiledNetwork{*model.network()}},
                          certified_guards(model, direct(), device)};
    EXPECT_EQ(controller.start(), Status::Ok);
    Pressed run;
    const auto tick = [&] {
        const Status status = controller.tick().status;
        run.energy_limited += status == Status::EnergyLimited ? 1 : 0;
        run.limit_cycle_scaled += status == Status::LimitCycleScaled ? 1 : 0;
        ++run.ticks;
    };
    for (int k = 0; k < 300; ++k) {  // the ramp
        tick();
    }
    handle.begin_account();
    test::Random random{7};
    for (int k = 0; k < presses; ++k) {
        const double slower = k % 1000 == 17 ? 0.01 : k % 50 == 7 ? 0.1 : 1.0;
        const double speed = slower * test::uniform(random, 0.8, 1.0) * device.encoder_step;
        const double bottom = test::uniform(random, 0.44, 0.46);
        const auto half = static_cast<int>((bottom - released) / speed);
        for (int way = 0; way <= 2 * half; ++way) {
            handle.move_to(bottom - speed * std::abs(half - way));
            tick();
        }
    }
    run.least = handle.least();
    return run;
}

double knob_energy(double x) {
    return readme_knob().network()->curve().inside(x).integral;
}

TEST(GuardedAccount, SlowPressesOfTheReadmeKnobAreNeverLimitedNorGiveEnergy) {
    const Pressed run = press_readme_knob(test::cases(500, 2000));
    EXPECT_EQ(run.energy_limited, 0U) << "of " << run.ticks << " ticks";
    EXPECT_EQ(run.limit_cycle_scaled, 0U);
    const double held = knob_energy(0.2) - energy_range(readme_knob()).least;
    EXPECT_GE(run.least, -held);
}

// An encoder reading that alternates between two counts adds at most the energy L Delta^2 for each cycle (slope bound
// L, encoder step Delta), and the energy account does not act.
TEST(GuardedAccount, AFlickeringCountIsNotLimited) {
    const DeviceProfile device = bench_knob();
    const ForceModel model = readme_knob();
    const double border = device.encoder_step * (std::floor(0.4 / device.encoder_step) + 0.5);
    GuidedHandle handle{device, border};
    Controller controller{handle, Direct{CompiledNetwork{*model.network()}},
                          certified_guards(model, direct(), device)};
    ASSERT_EQ(controller.start(), Status::Ok);
    std::size_t energy_limited = 0;
    const int ticks = test::cases(2'000'000);
    for (int k = 0; k < ticks; ++k) {
        handle.move_to(border + (k % 2 == 0 ? 1e-12 : -1e-12));
        energy_limited += controller.tick().status == Status::EnergyLimited ? 1 : 0;
    }
    EXPECT_EQ(energy_limited, 0U);
    const EnergyAccount& account = controller.guards().account;
    EXPECT_GT(account.left(), account.stored().most() - 1e-6);
    EXPECT_NEAR(controller.guards().observer.energy(), handle.motor(), 1e-4);
}

/// Motions, one displacement for each sample, that try to take all the energy of the account.
class Motions {
  public:
    Motions(test::Random& random, const test::Scene& scene)
        : kind_{random() % 6},
          centre_{random() % 2 == 0 ? scene.steepest : test::uniform(random, 0.0, 1.0)},
          reach_{std::exp(test::uniform(random, -6.0, -1.0))},
          angle_{random() % 2 == 0 ? std::numbers::pi : test::uniform(random, 0.01, std::numbers::pi)} {
        if (random() % 4 == 0 && scene.device.encoder_step > 0.0) {
            reach_ = scene.device.encoder_step * test::uniform(random, 0.1, 6.0);
        }
    }

    double next(test::Random& random, int tick) { return std::clamp(wanted(random, tick), -0.1, 1.1); }

  private:
    double wanted(test::Random& random, int tick) {
        switch (kind_) {
            case 0:
            case 1:
            case 2:
                return centre_ + reach_ * std::cos(angle_ * tick);
            case 3:
                return centre_ + reach_ * test::uniform(random, -1.0, 1.0);
            case 4:  // handle moved back and forth at constant speed
                return centre_ + reach_ * (2.0 * std::abs(std::remainder(angle_ * tick, 2.0)) - 1.0);
            default:
                offset_ = std::clamp(offset_ + 0.3 * reach_ * test::uniform(random, -1.0, 1.0), -1.0, 1.0);
                return centre_ + offset_;
        }
    }

    std::uint64_t kind_;
    double centre_;
    double reach_;
    double angle_;
    double offset_ = 0.0;
};

// Tests random motions on devices with exactly the damping and friction that a certificate requires.
TEST(GuardedAccount, NoMotionLimitsACertifiedRendering) {
    test::Random random{31};
    double most = 0.0;
    std::map<std::string, int> scenes;
    for (int k = 0; k < test::cases(100); ++k) {
        test::Scene scene = test::random_certified_scene(random, 1.0 + 1e-9);
        scene.device.force_limit = std::exp(test::uniform(random, -2.0, 3.0));
        if (!certify(scene.model, scene.scheme, scene.device).certified()) {
            continue;  // with a force limit the device cannot be certified for this structure
        }
        ++scenes[std::string(name_of(scene.scheme.structure))];
        Motions motion{random, scene};
        GuidedHandle handle{scene.device, scene.start};
        const Guards guards = certified_guards(scene.model, scene.scheme, scene.device);
        Controller controller{
            handle,
            make_structure(scene.model, scene.scheme, scene.device.period_s, scene.device.force_limit),
            guards};
        ASSERT_EQ(controller.start(), Status::Ok);
        std::size_t energy_limited = 0;
        const EnergyAccount& account = controller.guards().account;
        double least = std::numeric_limits<double>::infinity();
        for (int tick = 0; tick < 3000; ++tick) {
            handle.move_to(tick < 5 ? scene.start : motion.next(random, tick));
            energy_limited += controller.tick().status == Status::EnergyLimited ? 1 : 0;
            least = std::min(least, account.left());
        }
        EXPECT_EQ(energy_limited, 0U)
            << "scene " << k << ": " << scene << "; left " << least << " of " << account.stored().most();
        most = std::max(most, 1.0 - least / account.stored().most());
    }
    // The bound on the energy that an object stores is close to the largest energy that an object gave.
    EXPECT_GT(most, 0.3);
    EXPECT_GE(scenes.size(), 2U);
    for (const auto& [structure, count] : scenes) {
        RecordProperty(structure, count);
    }
}

// Tests random motions on devices that are much too weak for a proof. The handle sums its own energy.
TEST(GuardedAccount, NoMotionTakesMoreThanTheStoredEnergyFromAnUnprovedRendering) {
    test::Random random{37};
    double deepest = 0.0;
    std::size_t limited = 0;
    for (int k = 0; k < test::cases(100); ++k) {
        test::Scene scene = test::random_certified_scene(random, 1.0);
        scene.device.viscous_damping *= test::uniform(random, 0.02, 0.5);
        scene.device.coulomb_friction *= test::uniform(random, 0.0, 0.5);
        if (certify(scene.model, scene.scheme, scene.device).certified()) {
            continue;
        }
        Motions motion{random, scene};
        GuidedHandle handle{scene.device, scene.start};
        Guards guards = certified_guards(scene.model, scene.scheme, scene.device, false);
        guards.limit_cycle = {};
        Controller controller{
            handle,
            make_structure(scene.model, scene.scheme, scene.device.period_s, scene.device.force_limit),
            guards};
        ASSERT_EQ(controller.start(), Status::Ok);
        for (int tick = 0; tick < 3000; ++tick) {
            handle.move_to(tick < 5 ? scene.start : motion.next(random, tick));
            limited += controller.tick().status == Status::EnergyLimited ? 1 : 0;
        }
        const double allowed = controller.guards().account.stored().within();
        EXPECT_GE(handle.least(), -allowed * (1.0 + 1e-9)) << "scene " << k << ": " << scene;
        deepest = std::min(deepest, handle.least() / allowed);
    }
    EXPECT_GT(limited, 1000U);
    EXPECT_LT(deepest, -0.5) << "the motions take much energy";
}

// A heavy object almost does not follow the handle, so its soft coupling stores more energy than the object can.
TEST(GuardedAccount, AStretchedCouplingOfAHeavyObjectIsNotLimited) {
    DeviceProfile device;
    device.encoder_step = 0.0;
    device.viscous_damping = 0.005;
    Scheme scheme;
    scheme.structure = StructureKind::Implicit;
    scheme.coupling = {0.3, 0.0};
    scheme.inertia = {10.0, 0.1};
    const ForceModel soft{NetworkParameters{1, {}, {}, {}, {0.01}, 0.0}, test::unit_domain()};
    ASSERT_TRUE(certify(soft, scheme, device).certified());
    GuidedHandle handle{device, 0.0};
    Guards guards = certified_guards(soft, scheme, device);
    guards.limit_cycle = {};
    Controller controller{handle, make_structure(soft, scheme, device.period_s, device.force_limit), guards};
    EXPECT_EQ(controller.start(), Status::Ok);
    for (int k = 0; k < 2000; ++k) {
        handle.move_to(0.5 - 0.5 * std::cos(0.01 * k));
        ASSERT_NE(controller.tick().status, Status::EnergyLimited) << k;
    }
    EXPECT_GT(controller.guards().account.stored().most(), largest_stored_energy(soft, scheme, 5.0) + 0.01);
}

// A spring of stiffness 2 b / T, moved back and forth at every sample, generates exactly the energy that the device
// damping b dissipates.
TEST(GuardedAccount, SlowMotionOnASpringAtItsBoundNeedsFullCredit) {
    DeviceProfile device;
    device.encoder_step = 0.0;
    const double stiffness = (2.0 - 1e-8) * device.viscous_damping / device.period_s;
    const ForceModel spring{NetworkParameters{1, {}, {}, {}, {stiffness}, 0.0},
                            {{-0.04}, {0.04}, Continuation::Linear, Continuation::Linear, std::nullopt}};
    ASSERT_TRUE(certify(spring, direct(), device).certified());
    const auto energy_limited = [&](bool certified) {
        GuidedHandle handle{device, 0.0};
        Guards guards = certified_guards(spring, direct(), device, certified);
        guards.limit_cycle = {};
        Controller controller{handle, Direct{CompiledNetwork{*spring.network()}}, guards};
        EXPECT_EQ(controller.start(), Status::Ok);
        std::size_t count = 0;
        for (int k = 0; k < 10'000; ++k) {
            handle.move_to(k % 2 == 0 ? 0.03 : -0.03);
            count += controller.tick().status == Status::EnergyLimited ? 1 : 0;
        }
        return count;
    };
    EXPECT_EQ(energy_limited(true), 0U);
    EXPECT_GT(energy_limited(false), 1000U);
}

// A hand may press an object further than the recording covers; the energy stored outside the domain is returned on
// release.
TEST(GuardedAccount, PressesBeyondTheDomainAreNotLimited) {
    const DeviceProfile device = bench_knob();
    const ForceModel model = readme_knob();
    GuidedHandle handle{device, 0.4};
    Controller controller{handle, Direct{CompiledNetwork{*model.network()}},
                          certified_guards(model, direct(), device)};
    ASSERT_EQ(controller.start(), Status::Ok);
    std::size_t energy_limited = 0;
    for (int k = 0; k < 20'000; ++k) {
        handle.move_to(0.6 - 0.2 * std::cos(2.0 * std::numbers::pi * k / 1000.0));
        energy_limited += controller.tick().status == Status::EnergyLimited ? 1 : 0;
    }
    EXPECT_EQ(energy_limited, 0U);
    const StoredEnergy& stored = controller.guards().account.stored();
    EXPECT_NEAR(stored.most() - stored.within(), 5.0 * (0.8 - model.domain().upper[0]), 0.01);
}

/// A wheel whose force has one peak of 8 N*m, and a constant chosen so that the mean force is 0 when the peak is
/// clipped at 5 N*m.
struct Wheel {
    using State = Stateless;
    double pull = 0.0;

    [[nodiscard]] EnvironmentSample at(double x, const State& /*stateless*/) const noexcept {
        const double u = std::remainder(x, 2.0 * std::numbers::pi) / 0.2;
        return {8.0 * std::exp(-u * u) - pull, 0.0, 0.0, false};
    }
    void advance(double /*x*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*x*/) const noexcept { return {}; }
};

Wheel balanced_wheel(double limit) {
    const auto work = [&](double pull) {
        double sum = 0.0;
        for (int k = 0; k < 20'000; ++k) {
            const double force = Wheel{pull}.at(2.0 * std::numbers::pi * k / 20'000.0, {}).force;
            sum += std::clamp(force, -limit, limit);
        }
        return sum;
    };
    double low = 0.0;
    double high = limit;
    for (int k = 0; k < 60; ++k) {
        const double middle = 0.5 * (low + high);
        (work(middle) > 0.0 ? low : high) = middle;
    }
    return {low};
}

// The mean of the limited force is 0. The limit-cycle detector scales the limited force, so the mean stays 0. If it
// scaled the force before the force limit, the mean would not be 0 and the force would drive the wheel.
TEST(GuardedAccount, ScaledWheelWithAForceLimitIsPassive) {
    DeviceProfile device;
    device.encoder_step = device.viscous_damping = 0.0;
    Guards guards;
    guards.limit = {5.0};
    LimitCycleDetector detector{{0.05, 25, 0.0}};
    for (int k = 0; detector.limit_cycles() == 0; ++k) {
        detector.watch(k % 2 == 0 ? 0.01 : -0.01, k % 2 == 0 ? 1.0 : -1.0);
    }
    ASSERT_NEAR(detector.scale(), 0.7, 1e-12);
    guards.limit_cycle = detector;
    GuidedHandle handle{device, 0.0};
    Controller controller{handle, Direct{balanced_wheel(5.0)}, guards};
    ASSERT_EQ(controller.start(), Status::Ok);
    constexpr int turn = 20'000;
    for (const int direction : {1, -1}) {
        (void)controller.tick();
        handle.begin_account();
        for (int k = 1; k <= turn; ++k) {
            handle.move_to(direction * 2.0 * std::numbers::pi * (direction > 0 ? k : k - turn) / turn);
            (void)controller.tick();
        }
        EXPECT_NEAR(handle.energy(), 0.0, 1e-3) << "J in a turn, direction " << direction;
    }
    EXPECT_EQ(controller.guards().limit_cycle.limit_cycles(), 1U);
}

TEST(GuardedAccount, ALimitedForceIsScaledAfterItsLimit) {
    DeviceProfile device;
    GuidedHandle handle{device, 0.1};
    Guards guards;
    guards.limit = {2.0};
    guards.ramp = {4, 0};
    Controller controller{handle, Direct{test::Spring{100.0}}, guards};
    ASSERT_EQ(controller.start(), Status::Ok);
    for (const double force : {0.0, 0.5, 1.0, 1.5, 2.0, 2.0}) {
        EXPECT_DOUBLE_EQ(controller.tick().command.force, force);
    }
}

// While the start ramp increases the force, a handle can be moved in against a small force and pushed out by a larger
// one. The account of the energy given begins after the ramp; energy given during the ramp is stated separately.
TEST(GuardedAccount, EnergyOfTheRampIsAccountedSeparately) {
    constexpr double stiffness = 20.0;
    constexpr double reach = 0.1;
    constexpr double stored = 0.5 * stiffness * reach * reach;
    for (const bool during : {true, false}) {
        DeviceProfile device;
        device.encoder_step = device.viscous_damping = 0.0;
        Guards guards;
        guards.limit = {5.0};
        guards.ramp = {200, 0};
        GuidedHandle handle{device, 0.0};
        Controller controller{handle, Direct{test::Spring{stiffness}}, guards};
        ASSERT_EQ(controller.start(), Status::Ok);
        double after_ramp = 0.0;
        for (int k = 0; k < 400; ++k) {
            const int out = during ? 150 : 250;
            handle.move_to(reach * std::clamp(k < out ? k / 20.0 : 1.0 - (k - out) / 20.0, 0.0, 1.0));
            (void)controller.tick();
            if (k == 200) {
                after_ramp = handle.energy();
            }
        }
        const double in_ramp = -controller.guards().ramp_observer.least();
        const double after = -controller.guards().observer.least();
        EXPECT_LT(in_ramp, stored);
        // Without device damping each sample of the outward motion adds K d^2 / 2, with stiffness K and displacement
        // d.
        EXPECT_LT(after, 1.2 * stored);
        EXPECT_NEAR(-controller.guards().observer.energy(), after_ramp - handle.energy(), 1e-12);
        if (during) {
            EXPECT_GT(in_ramp, 0.5 * stored);
            EXPECT_NEAR(in_ramp, -handle.least(), 1e-12);
            EXPECT_EQ(after, 0.0);
        } else {
            EXPECT_LT(in_ramp, 1e-9);
            EXPECT_GT(after, 0.9 * stored);
        }
    }
}

/// Returns the difference between the largest and the least energy of the limited force c(f) over the domain, by a
/// fine sum, and the energy that the play operator can store.
double stored_span(const ForceModel& model, double limit) {
    constexpr int cells = 200'000;
    const double lower = model.domain().lower[0];
    const double travel = model.domain().upper[0] - lower;
    const HysteresisNetwork* both = model.hysteresis();
    const NetworkCurve& force = both != nullptr ? both->force() : model.network()->curve();
    double energy = 0.0;
    double least = 0.0;
    double largest = 0.0;
    for (int k = 0; k < cells; ++k) {
        const double x = lower + travel * (k + 0.5) / cells;
        energy += std::clamp(force.inside(x).value, -limit, limit) * travel / cells;
        least = std::min(least, energy);
        // Energy that the hysteresis adds while the play operator is at a limit of its slack; computed at every 1000th
        // position.
        double bent = 0.0;
        if (both != nullptr && k % 1000 == 0) {
            const double r = both->play_radius();
            for (int j = 0; j < 100; ++j) {
                const double at = x - r + r * (j + 0.5) / 100.0;
                const double g = force.at(at).value;
                const double pull = (at - (x - r)) / r * both->hysteresis_force().at(at).value;
                bent += (std::clamp(g + pull, -limit, limit) - std::clamp(g, -limit, limit)) * r / 100.0;
            }
        }
        largest = std::max(largest, energy + bent);
    }
    return largest - least;
}

TEST(LargestStoredEnergy, BoundsTheEnergyOfTheClippedForce) {
    test::Random random{12};
    double worst = 1.0;
    for (int k = 0; k < test::cases(20); ++k) {
        const ForceModel model = test::random_model(random, k % 2 == 0);
        const double limit = std::exp(test::uniform(random, -3.0, 2.0));
        const double span = stored_span(model, limit);
        const double most = largest_stored_energy(model, direct(), limit);
        EXPECT_GE(most, span * (1.0 - 1e-5)) << "model " << k << ", limit " << limit;
        const double bend = model.hysteresis() == nullptr
                                ? 0.0
                                : 0.5 * model.hysteresis()->play_radius() *
                                      model.hysteresis()->hysteresis_force().value_bounds().upper;
        if (energy_range(model, limit).least > -1e300 && model.domain().below == Continuation::Linear) {
            worst = std::max(worst, (most - bend) / std::max(span, 1e-3));
        }
    }
    RecordProperty("largest over the sum", std::to_string(worst));
}

// The stored energy of a clipped force can vary more over the domain than that of the force itself, because clipping
// removes the energy of a peak.
TEST(LargestStoredEnergy, CanExceedThatOfTheForce) {
    NetworkParameters network;
    network.alpha = {6.0};
    network.beta = {1.5};
    network.weight = {-8.0};  // a peak of the force of size 8 between two valleys of the force
    network.linear = {0.0};
    network.bias = -0.5;
    const ForceModel model{network, {{0.0}, {3.0}, Continuation::Linear, Continuation::Linear, {}}};
    EXPECT_GT(largest_stored_energy(model, direct(), 3.0), 1.2 * largest_stored_energy(model, direct(), 1e9));
}

}  // namespace
}  // namespace palpate
