// SPDX-License-Identifier: Apache-2.0
// Tests that each guard acts on a fault, and does not act without one.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "limits/hands.hpp"
#include "palpate/guard/guards.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/simulation/closed_loop.hpp"
#include "scenes.hpp"
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
    settings.force_limit = device.force_limit;
    settings.device_damping = device.viscous_damping;
    settings.device_friction = device.coulomb_friction;
    settings.encoder_step = device.encoder_step;
    return settings;
}

struct Guarded {
    std::vector<double> forces;
    std::size_t drained = 0;
    std::size_t softened = 0;
    EnergyAccount energy;
};

template <SimulatedHand H>
Guarded render(const ForceModel& model, const DeviceProfile& device, const Guards& guards, H hand,
               std::size_t ticks, double start) {
    Guarded run;
    const auto watch = [&](const Tick& tick, const Motion& /*handle*/, const EnergyAccount& /*account*/) {
        run.forces.push_back(tick.command.force);
        run.drained += tick.status == Status::Drained ? 1 : 0;
        run.softened += tick.status == Status::Softened ? 1 : 0;
        return true;
    };
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    run.energy =
        with_structure(model, scheme, device.period_s, device.force_limit, [&](auto structure) {
            return closed_loop(std::move(structure), device, hand, ticks, {20, start, 0.0, guards}, watch);
        }).energy;
    return run;
}

Scheme direct() {
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    return scheme;
}

// The scene of spec section 6, quantised and without friction: the guards do not change the force.
TEST(Guards, TouchNoForceOfTheComparisonScene) {
    const test::ClickAndWall object;
    double held = 0.0;
    for (double x = 0.0; x < 0.5; x += 1e-5) {
        held += object.at(x, {}).force * 1e-5;
    }
    const DeviceProfile device;
    Guards guards = guards_of(settings_for(device), wall(60.0), direct(), period);
    guards.tank =
        EnergyTank{{{.within = held}, 0.9 * device.viscous_damping, 0.0, device.encoder_step, period}};
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

TEST(Guards, TouchNoForceOfCertifiedScenes) {
    test::Random random{3};
    for (int k = 0; k < test::cases(60); ++k) {
        test::Scene scene = test::random_certified_scene(random, 1.25);
        scene.device.force_limit = 1e9;
        GuardSettings settings = settings_for(scene.device);
        settings.buzz_force = 0.01;
        settings.certified = true;
        Guards guards = guards_of(settings, scene.model, scene.scheme, scene.device.period_s);
        guards.reading = {};
        std::size_t acted = 0;
        const Hand hand{50.0, 0.05, 0.1, 0.9, test::uniform(random, 0.5, 8.0)};
        with_structure(
            scene.model, scene.scheme, scene.device.period_s, scene.device.force_limit, [&](auto structure) {
                return closed_loop(
                    std::move(structure), scene.device, hand, 1000, {8, 0.1, 0.0, guards},
                    [&](const Tick& tick, const Motion& /*handle*/, const EnergyAccount& /*account*/) {
                        acted += tick.status == Status::Drained || tick.status == Status::Softened;
                        return true;
                    });
            });
        EXPECT_EQ(acted, 0U) << scene;
    }
}

TEST(EnergyTank, PaysForNoMoreThanTheObjectHolds) {
    test::Random random{9};
    for (int k = 0; k < test::cases(50); ++k) {
        DeviceProfile device;
        device.encoder_step = 0.0;
        device.delay_s = static_cast<double>(random() % 3) * device.period_s;
        const double stiffness = test::uniform(random, 1.5, 8.0) * 2.0 * device.viscous_damping / period;
        const ForceModel model = wall(stiffness);
        GuardSettings settings = settings_for(device);
        settings.buzz_force = 0.0;
        const double held = most_energy(model, direct(), device.force_limit);
        const auto lost = [&](bool tank) {
            settings.energy_tank = tank;
            const Guarded run = render(model, device, guards_of(settings, model, direct(), period),
                                       PassiveHand{15.0, 0.0, 0.0, 0.1}, 5000, 0.02);
            // Energy that the motor gave, minus nine tenths of the losses of the device.
            return -(run.energy.motor + 0.9 * run.energy.loss);
        };
        EXPECT_LT(lost(true), 1.3 * held) << stiffness << " delay " << device.late_samples();
        EXPECT_GT(lost(false), 2.0 * held) << stiffness << " delay " << device.late_samples();
    }
}

TEST(EnergyTank, LetsForcesFadeWithinItsReserve) {
    EnergyTank tank{TankSettings{{.within = 1.0}, 0.0, 0.0, 0.0, period}};
    double force = -2.0;
    tank.book(-1.0, 1.0);  // the energy of the object; the reserve of 0.25 remains
    EXPECT_EQ(tank.apply(force), Status::Ok);
    tank.book(-0.15, 1.0);
    EXPECT_EQ(tank.apply(force), Status::Drained);
    EXPECT_NEAR(force, -2.0 * 0.1 / 0.25, 1e-12);
    tank.book(-0.1, 1.0);
    force = 2.0;
    EXPECT_EQ(tank.apply(force), Status::Drained);
    EXPECT_NEAR(force, 0.0, 1e-12);
    tank.book(3.0, 1.0);  // never more than full
    EXPECT_NEAR(tank.given(), 0.0, 1e-12);
    EXPECT_NEAR(tank.most_given(), 1.25, 1e-12);
}

TEST(EnergyTank, DoesNotChargeWhatTheDeviceTakes) {
    EnergyTank tank{TankSettings{{.within = 1.0}, 0.06, 0.02, 0.01, period}};
    tank.book(-30.0, 0.03);
    EXPECT_NEAR(tank.given(), 0.9 - (0.06 * 0.02 * 0.02 / period + 0.02 * 0.02), 1e-12);
}

TEST(StoredEnergy, GrowsWithWhereItHasBeen) {
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
    stored.visit(0.0, 0.4);  // stretched by 0.3 more than at the limit
    EXPECT_NEAR(stored.most(), 1.0 + 5.0 * 0.3, 1e-12);
}

TEST(ReadMotion, MovesNoFartherThanTheHandleMust) {
    test::Random random{4};
    for (int k = 0; k < test::cases(200); ++k) {
        const double step = std::exp(test::uniform(random, -6.0, 0.0));
        ReadMotion motion{step};
        double at = test::uniform(random, -1.0, 1.0);
        double true_way = 0.0;
        double read_way = 0.0;
        const double reach = step * std::exp(test::uniform(random, -3.0, 2.0));
        (void)motion.to(step * std::round(at / step));
        for (int tick = 0; tick < 500; ++tick) {
            const double moved = reach * test::uniform(random, -1.0, 1.0);
            at += moved;
            true_way += std::abs(moved);
            read_way += std::abs(motion.to(step * std::round(at / step)));
            ASSERT_LE(read_way, true_way + 0.5 * step + 1e-12);
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

TEST(EnergyTank, WithoutSizeHasNoEnd) {
    EnergyTank tank;
    double force = -1.0;
    tank.book(-1e9, 1.0);
    EXPECT_EQ(tank.apply(force), Status::Ok);
    EXPECT_EQ(force, -1.0);
}

TEST(EnergyTank, IsSizedByTheModelAndItsCoupling) {
    const ForceModel model = wall(100.0);
    EXPECT_NEAR(most_energy(model, direct(), 20.0), 0.5, 1e-6);
    EXPECT_NEAR(most_energy(model, direct(), 5.0), 0.125 + 0.25, 1e-6);  // of the clipped force
    Scheme coupled;
    coupled.coupling.stiffness = 50.0;
    EXPECT_NEAR(most_energy(model, coupled, 5.0), 0.375 + 0.5 * 25.0 / 50.0, 1e-6);
    coupled.compensated = true;
    EXPECT_NEAR(most_energy(model, coupled, 5.0), 0.375 + 25.0 / 50.0, 1e-6);
    const ForceModel motor{NetworkParameters{1, {}, {}, {}, {0.0}, 1.0}, {{0.0}, {1.0}, {}, {}, 1.0}};
    EXPECT_TRUE(std::isinf(most_energy(motor, direct(), 5.0)));
}

// The account of the observer equals that of the simulation if the encoder is without steps.
TEST(PassivityObserver, SeesWhatTheMotorTook) {
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

TEST(LimitCycleDetector, FindsABuzzAndScalesItDown) {
    for (const double frequency : {30.0, 120.0, 333.0, 499.0}) {
        Watched buzz;
        buzz.shake(frequency, 2e-3, 0.0, 1000);
        EXPECT_GE(buzz.detector.buzzes(), 1U) << frequency;
        EXPECT_NEAR(buzz.detector.scale(), std::pow(0.7, buzz.detector.buzzes()), 1e-12);
    }
}

TEST(LimitCycleDetector, LeavesAloneWhatIsNoBuzz) {
    Watched slow;
    slow.shake(12.0, 2e-2, 0.0, 4000);
    EXPECT_EQ(slow.detector.buzzes(), 0U);
    Watched dying;
    dying.shake(100.0, 2e-2, 0.015, 4000);
    EXPECT_EQ(dying.detector.buzzes(), 0U);
    Watched faint;
    faint.shake(100.0, 1e-4, 0.0, 4000);
    EXPECT_EQ(faint.detector.buzzes(), 0U);
    Watched turning;  // detents pass fast, but the knob never reverses
    turning.shake(100.0, 2e-3, 0.0, 4000, 2e-3);
    EXPECT_EQ(turning.detector.buzzes(), 0U);
}

TEST(LimitCycleDetector, StopsABuzzingWallAndSaysSo) {
    const DeviceProfile device;
    const ForceModel model = wall(5.0 * 2.0 * device.viscous_damping / period);
    GuardSettings settings = settings_for(device);
    settings.energy_tank = false;
    const auto swing = [&](double buzz_force) {
        settings.buzz_force = buzz_force;
        Guarded run = render(model, device, guards_of(settings, model, direct(), period),
                             PassiveHand{15.0, 0.0, 0.0, 0.1}, 3000, 0.0);
        const auto [low, high] = std::minmax_element(run.forces.end() - 500, run.forces.end());
        return std::pair{*high - *low, run.softened};
    };
    EXPECT_GT(swing(0.0).first, 5.0);
    EXPECT_EQ(swing(0.0).second, 0U);
    EXPECT_LT(swing(0.05).first, 0.2);
    EXPECT_GT(swing(0.05).second, 1000U);
}

TEST(GuardSettings, RefusesWhatIsImpossible) {
    for (double GuardSettings::* field : {&GuardSettings::buzz_force, &GuardSettings::device_damping,
                                          &GuardSettings::device_friction, &GuardSettings::encoder_step}) {
        GuardSettings settings;
        settings.*field = -1.0;
        EXPECT_THROW(validate(settings), std::invalid_argument);
        settings.*field = std::nan("");
        EXPECT_THROW(validate(settings), std::invalid_argument);
    }
}

}  // namespace
}  // namespace palpate
