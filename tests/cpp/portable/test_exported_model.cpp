// SPDX-License-Identifier: Apache-2.0
#include "palpate/portable/exported_model.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "palpate/portable/export_check.hpp"
#include "simulation/scenes.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::uniform;

/// Returns the direct structure, with a prediction from `predict` samples.
Scheme direct(int predict = 0) {
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    scheme.predict = predict;
    return scheme;
}

/// Returns a random periodic model, for example the detents of a knob.
ForceModel random_periodic_model(Random& random) {
    NetworkParameters network = test::random_network(random, 1 + random() % 6);
    network.linear = {0.0};
    if (random() % 2 == 0) {
        network = test::with_harmonics(random, network, 1 + random() % 9);
    }
    Domain domain = test::unit_domain();
    domain.period = 1.0;
    return {network, domain};
}

ForceModel random_model(Random& random) {
    return random() % 4 == 0 ? random_periodic_model(random) : test::random_model(random, random() % 3 == 0);
}

/// Returns a random structure that can be exported for the model.
Scheme random_scheme(Random& random, const ForceModel& model) {
    Scheme scheme;
    double steepest = std::max(model.slope_bounds().largest(), 0.1);
    if (const WaveletNetwork* network = model.network()) {
        for (const EdgeLine& line : {network->curve().below(), network->curve().above()}) {
            steepest = std::max(steepest, std::abs(line.at_edge.slope));
        }
    }
    scheme.coupling.stiffness = steepest * uniform(random, 1.2, 5.0);
    scheme.coupling.damping =
        random() % 4 == 0 ? 0.0 : scheme.coupling.stiffness * 1e-3 * uniform(random, 0.0, 4.0);
    scheme.structure =
        model.hysteresis() == nullptr && random() % 2 == 0 ? StructureKind::Massless : StructureKind::Direct;
    scheme.compensated = scheme.structure == StructureKind::Massless && random() % 2 == 0;
    scheme.predict = scheme.structure == StructureKind::Direct && random() % 2 == 0
                         ? 1 + static_cast<int>(random() % 16)
                         : 0;
    return scheme;
}

ExportTarget random_target(Random& random, Precision precision) {
    return {std::exp(-uniform(random, 4.0, 13.0)), std::exp(-uniform(random, 6.0, 10.0)),
            uniform(random, 0.2, 4.0), precision};
}

/// Returns the message with which an export is refused; empty if it is accepted.
std::string refusal(const ForceModel& model, const Scheme& scheme, const ExportTarget& target) {
    return test::refusal([&] { const ExportedModel exported{model, scheme, target}; });
}

class ExportedModelOf : public testing::TestWithParam<Precision> {};

TEST_P(ExportedModelOf, EveryRandomModelAndStructureIsWithinItsProvedBounds) {
    Random random{17};
    for (int k = 0; k < cases(20, 60); ++k) {
        const ForceModel model = random_model(random);
        Scheme scheme = random_scheme(random, model);
        ExportTarget target = random_target(random, GetParam());
        if (scheme.structure == StructureKind::Massless) {  // the lag may be 2^22 counts
            target.encoder_step =
                std::max(target.encoder_step, target.force_limit / scheme.coupling.stiffness * 0x1p-20);
        }
        std::optional<ExportedModel> exported;
        const std::string refused = test::refusal([&] { exported.emplace(model, scheme, target); });
        if (!refused.empty()) {
            // With a soft coupling the force on a load line changes faster than the force law
            ASSERT_EQ(scheme.structure, StructureKind::Massless) << k << ": " << refused;
            ASSERT_TRUE(refused.ends_with(": plan a stiffer coupling")) << k << ": " << refused;
            scheme.coupling.stiffness *= 10.0;
            exported.emplace(model, scheme, target);
        }
        const ExportCheck check = checked_export(*exported, 1000, static_cast<std::uint64_t>(k));
        ASSERT_TRUE(check.passed()) << k << ": " << check.force << " " << check.slope << " " << check.energy
                                    << " " << check.step << ", structure " << name_of(scheme.structure)
                                    << ", predict " << scheme.predict << ", compensated "
                                    << scheme.compensated << ", hysteresis "
                                    << (model.hysteresis() != nullptr) << ", periodic "
                                    << exported->periodic() << ", step " << target.encoder_step;
    }
}

TEST_P(ExportedModelOf, EveryRandomMemoryIsWithinItsProvedBounds) {
    Random random{22};
    for (int k = 0; k < cases(40); ++k) {
        const Domain domain =
            test::unit_domain(random() % 2 == 0 ? Continuation::Linear : Continuation::Free);
        const ForceModel model =
            ForceModel{test::random_network(random, 1 + random() % 4), domain}.with_memory(
                test::random_memory(random));
        const ExportTarget target = random_target(random, GetParam());
        const ExportedModel exported{model, direct(), target};
        const ExportCheck check = checked_export(exported, 1000, static_cast<std::uint64_t>(k));
        ASSERT_TRUE(check.passed()) << k << ": " << check.force << " " << check.slope << " " << check.energy
                                    << " " << check.step << ", step " << target.encoder_step;
        // The coordinate of the branches moves by one antiderivative less another: each has the error of half a cell,
        // times the stiffness of the branches. It is large for branches that slip after a small part of a cell.
        const ExportedMemory& memory = *exported.memory();
        const double stiffness = std::accumulate(memory.stiffness.begin(), memory.stiffness.end(), 0.0);
        const double of_branches = exported.law().errors()[1].largest * stiffness * exported.law().widest();
        EXPECT_LE(exported.step_error(), (GetParam() == Precision::Single ? 2e-6 : 2e-9) *
                                             (1.0 + of_branches) * exported.largest_force())
            << k;
        EXPECT_FALSE(exported.step_error_lasts());
    }
}

TEST_P(ExportedModelOf, ForceAndSlopeAreAsAccurateAsPromised) {
    Random random{18};
    const bool single = GetParam() == Precision::Single;
    for (int k = 0; k < cases(60); ++k) {
        const ForceModel model = random_model(random);
        const ExportedModel exported{model, direct(), random_target(random, GetParam())};
        // A constant force has only the rounding of its slope
        const double slope = std::max(exported.largest_slope(), exported.largest_force());
        EXPECT_LE(exported.force_error(), (single ? 1e-6 : 1e-9) * exported.largest_force()) << k;
        EXPECT_LE(exported.slope_error(), (single ? 3e-5 : 2e-7) * slope) << k;
    }
}

INSTANTIATE_TEST_SUITE_P(Precisions, ExportedModelOf, testing::Values(Precision::Single, Precision::Double),
                         [](const auto& each) { return std::string(name_of(each.param)); });

TEST(ExportedModel, TablesOfManyWaveletsStaySmall) {
    Random random{19};
    for (const std::size_t wavelets : {8U, 16U, 32U, 64U, 128U}) {
        const ForceModel model{test::random_network(random, wavelets), test::unit_domain()};
        const ExportedModel exported{model, direct(), {1.0 / 65536.0, 0.0}};
        const double limit = wavelets == 8 ? 6e3 : 24e3;
        EXPECT_LE(static_cast<double>(exported.law().bytes()), limit) << wavelets;
    }
}

TEST(ExportedModel, FirstAndLastCountOfTheTableGiveTheForceOfTheDomain) {
    Random random{20};
    for (int k = 0; k < cases(40); ++k) {
        const ForceModel model = test::random_model(random, false);
        // Both ends of the domain are counts, the most difficult case for the last cell
        const ExportTarget target{std::ldexp(1.0, -3 - static_cast<int>(random() % 14)), 1e-3};
        const ExportedModel exported{model, direct(), target};
        const ExportedForce<float> force{exported};
        const auto state = force.start(0);
        const auto last = static_cast<std::int32_t>(1.0 / target.encoder_step);
        for (const std::int32_t count : {0, 1, last - 1, last}) {
            const double right = model.network()->at(count * target.encoder_step, {}).force;
            EXPECT_NEAR(force.force(state, count), right, exported.force_error()) << count;
        }
    }
}

TEST(ExportedModel, PeriodicForceRepeatsAtEveryCountOfThe32Bits) {
    Random random{21};
    const ForceModel model = random_periodic_model(random);
    // 4096 counts are a period, so the force at a count is exactly that 4096 counts later
    const ExportedModel exported{model, direct(), {1.0 / 4096.0, 0.0}};
    const ExportedForce<float> force{exported};
    const auto state = force.start(0);
    for (int k = 0; k < 10'000; ++k) {
        const auto count = static_cast<std::int32_t>(static_cast<std::uint32_t>(random()));
        const std::int32_t within = ((count % 4096) + 4096) % 4096;
        ASSERT_EQ(force.force(state, count), force.force(state, within)) << count;
    }
}

TEST(ExportedModel, CoarseCountsOfAPeriodAddNoError) {
    Random random{26};
    const ForceModel model = random_periodic_model(random);
    const ExportedModel fine{model, direct(), {1.0 / 4096.0, 0.0}};
    const ExportedModel coarse{model, direct(), {1.0 / 8.0, 0.0}};
    EXPECT_EQ(coarse.force_error(), fine.force_error());
}

TEST(ExportedModel, FirstStepStartsAtRest) {
    Random random{22};
    const ForceModel model = test::random_model(random, true);
    const ExportedModel exported{model, direct(3), {1e-4, 0.0}};
    const ExportedForce<float> force{exported};
    auto state = force.start(4000);
    EXPECT_NEAR(force.step(state, 4000), model.hysteresis()->sliding(0.4, 0.0).force, exported.step_error());
}

TEST(ExportedModel, MasslessForceStopsAtTheForceLimit) {
    Random random{23};
    const ForceModel model{NetworkParameters{1, {}, {}, {}, {10.0}, 0.0}, test::unit_domain()};
    Scheme scheme;
    scheme.coupling = {100.0, 0.05};
    const ExportedModel exported{model, scheme, {1e-4, 1e-3, 2.0}};
    const ExportedForce<float> force{exported};
    auto state = force.start(0);
    float last = 0.0F;
    for (int k = 0; k < 200; ++k) {
        last = force.step(state, 9000);
    }
    EXPECT_EQ(last, 2.0F);
}

TEST(ExportedModel, LongMasslessMotionDoesNotAddUpErrors) {
    Random random{24};
    const ForceModel model{test::random_network(random, 6), test::unit_domain()};
    Scheme scheme;
    scheme.coupling = {3.0 * model.slope_bounds().largest(), 0.0};
    scheme.coupling.damping = 5e-3 * scheme.coupling.stiffness;
    const ExportedModel exported{model, scheme, {1.0 / 65536.0, 1e-3, 10.0}};
    ASSERT_TRUE(exported.step_error_lasts());
    const ExportCheck check = checked_export(exported, static_cast<std::size_t>(cases(100'000)));
    EXPECT_TRUE(check.passed()) << check.step;
}

TEST(ExportedModel, OtherStructuresAndModelsAreRefusedWithTheCure) {
    Random random{25};
    const ForceModel position{test::random_network(random, 3), test::unit_domain()};
    const ForceModel hysteresis = test::random_model(random, true);
    const ExportTarget target{1e-4, 1e-3, 10.0};
    const auto with = [](StructureKind kind) {
        Scheme scheme;
        scheme.structure = kind;
        scheme.coupling = {1e4, 0.0};
        return scheme;
    };
    EXPECT_EQ(refusal(position, with(StructureKind::Direct), target), "");
    EXPECT_EQ(
        refusal(position, with(StructureKind::Implicit), target),
        "the structure implicit is not exported: plan the model without mass and damping, with --mass 0 "
        "--object-damping 0");
    EXPECT_EQ(refusal(hysteresis, with(StructureKind::Massless), target),
              "the structure massless is not exported for a model with hysteresis: plan the model "
              "without --coupling");
    EXPECT_NE(refusal(position, with(StructureKind::Direct), {0.0, 0.0}).find("--encoder-step"),
              std::string::npos);
    EXPECT_NE(
        refusal(position, with(StructureKind::Direct), {0.5, 0.0}).find("an eighth of the model's domain"),
        std::string::npos);
    EXPECT_NE(refusal(position, with(StructureKind::Direct), {1e-9, 0.0}).find("2^24 counts"),
              std::string::npos);
    const ForceModel moving = ForceModel::of_velocity(test::random_network(random, 2, 2),
                                                      {{0.0, -1.0}, {1.0, 1.0}, {}, {}, std::nullopt});
    EXPECT_NE(refusal(moving, with(StructureKind::Direct), target).find("--inputs position"),
              std::string::npos);
    const ForceModel soft_tissue = position.with_memory({.stiffness = {1.0}, .time_constant_s = {0.5}});
    EXPECT_NE(refusal(soft_tissue, with(StructureKind::Direct), {1e-3, 0.0}).find("needs the period"),
              std::string::npos);
    // A force that falls more steeply than the load line has several solutions
    const ForceModel falling{NetworkParameters{1, {10.0}, {0.5}, {-1.0}, {0.0}, 0.0}, test::unit_domain()};
    Scheme soft;
    soft.coupling = {0.5, 0.0};
    EXPECT_NE(refusal(falling, soft, target).find("plan a stiffer coupling"), std::string::npos);
}

}  // namespace
}  // namespace palpate
