// SPDX-License-Identifier: Apache-2.0
#include "palpate/rendering/compensated.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/rendering/scheme.hpp"
#include "special_values.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "palpate/stability/force_bounds.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::infinity;
constexpr double scheme_period = 1e-3;

ForceModel linear_model(double stiffness) {
    return {NetworkParameters{1, {}, {}, {}, {stiffness}, 0.0}, test::unit_domain()};
}

/// Returns a model with the force `stiffness` x + s `loss`, with the direction state s.
ForceModel lossy(double stiffness, double loss, std::optional<double> play_radius) {
    return {NetworkParameters{1, {}, {}, {}, {stiffness}, 0.0},
            {{}, 0.0, loss},
            test::unit_domain(),
            play_radius};
}

ForceModel of_velocity() {
    return ForceModel::of_velocity({2, {}, {}, {}, {5.0, 0.2}, 0.0}, {{0.0, -1.0}, {1.0, 1.0}, {}, {}, {}});
}

ForceModel with_memory() {
    MemoryParameters memory;
    memory.stiffness = {2.0};
    memory.time_constant_s = {0.1};
    return linear_model(5.0).with_memory(memory);
}

Scheme scheme_of(StructureKind kind) {
    Scheme scheme;
    scheme.structure = kind;
    return scheme;
}

using test::refusal;

std::string refused(const Scheme& scheme, const ForceModel& model) {
    return refusal([&] { validate(scheme, model); });
}

TEST(Scheme, UsedPartHasOnlyTheNumbersOfItsStructure) {
    for (std::size_t k = 0; k < structure_names.size(); ++k) {
        const auto kind = static_cast<StructureKind>(k);
        const Scheme used = used_part(scheme_of(kind));
        const bool direct = kind == StructureKind::Direct || kind == StructureKind::Tangent;
        const bool massless = kind == StructureKind::Massless;
        EXPECT_EQ(used.coupling.stiffness, direct ? 0.0 : 100.0);
        EXPECT_EQ(used.coupling.damping, direct ? 0.0 : 0.02);
        EXPECT_EQ(used.inertia.mass, direct || massless ? 0.0 : 0.001);
        EXPECT_EQ(used.inertia.damping, direct || massless ? 0.0 : 0.5);
        EXPECT_EQ(used.structure, kind);
    }
}

TEST(Scheme, RefusalOfAModelNamesTheStructure) {
    for (const StructureKind kind : {StructureKind::Massless, StructureKind::Implicit,
                                     StructureKind::Explicit, StructureKind::EnergyConsistent}) {
        const std::string start = "structure is " + std::string(name_of(kind)) +
                                  ", must be direct: only the direct structure can render a force ";
        EXPECT_EQ(refused(scheme_of(kind), of_velocity()), start + "of position and velocity");
        EXPECT_EQ(refused(scheme_of(kind), with_memory()), start + "with memory");
        EXPECT_EQ(refused(scheme_of(kind), linear_model(5.0)), "");
    }
    EXPECT_EQ(refused(scheme_of(StructureKind::Direct), of_velocity()), "");
    EXPECT_EQ(refused(scheme_of(StructureKind::Direct), with_memory()), "");
    test::Random random{1};
    const ForceModel plate{test::random_network(random, 4, 2), {{0.0, 0.0}, {1.0, 1.0}, {}, {}, {}}};
    EXPECT_NE(refused(scheme_of(StructureKind::Direct), plate), "");
}

TEST(Scheme, RefusalOfANumberNamesItsFieldValueAndRule) {
    for (std::size_t k = 0; k < structure_names.size(); ++k) {
        const auto kind = static_cast<StructureKind>(k);
        const auto with = [&](auto change) {
            Scheme scheme = scheme_of(kind);
            change(scheme);
            return refused(scheme, linear_model(5.0));
        };
        const auto only_if = [](bool used, const std::string& message) { return used ? message : ""; };
        EXPECT_EQ(with([](Scheme& s) { s.coupling.stiffness = 0.0; }),
                  only_if(has_coupling(kind), "coupling_stiffness is 0, must be > 0"));
        EXPECT_EQ(with([](Scheme& s) { s.coupling.damping = -1.0; }),
                  only_if(has_coupling(kind), "coupling_damping is -1, must be >= 0"));
        EXPECT_EQ(with([](Scheme& s) { s.inertia.mass = 0.0; }),
                  only_if(has_mass(kind), "mass is 0, must be > 0"));
        EXPECT_EQ(with([](Scheme& s) { s.inertia.damping = -1.0; }),
                  only_if(has_mass(kind), "object_damping is -1, must be >= 0"));
        EXPECT_EQ(with([](Scheme& s) { s.inertia.damping = s.coupling.damping = 0.0; }), "");
        EXPECT_EQ(with([](Scheme& s) { s.play_radius = -1.0; }), "play_radius is -1, must be >= 0");
        EXPECT_EQ(with([](Scheme& s) { s.play_radius = infinity; }), "play_radius is inf, must be >= 0");
    }
}

TEST(Scheme, RefusesPredictionsThatItsStructureOrModelCannotUse) {
    const auto with = [](StructureKind kind, const ForceModel& model, int predict) {
        Scheme scheme = scheme_of(kind);
        scheme.predict = predict;
        return refused(scheme, model);
    };
    for (const int predict : {0, 1, 16}) {
        EXPECT_EQ(with(StructureKind::Direct, linear_model(5.0), predict), "");
    }
    EXPECT_EQ(with(StructureKind::Direct, linear_model(5.0), 17), "predict is 17, must be 0 to 16");
    EXPECT_EQ(with(StructureKind::Direct, linear_model(5.0), -1), "predict is -1, must be 0 to 16");
    EXPECT_EQ(with(StructureKind::Massless, linear_model(5.0), 1),
              "predict is 1, must be 0 for the structure massless");
    EXPECT_EQ(with(StructureKind::Direct, of_velocity(), 1),
              "predict is 1, must be 0 for a force of position and velocity");
    EXPECT_EQ(with(StructureKind::Direct, with_memory(), 1),
              "predict is 1, must be 0 for a force with memory");
}

TEST(Scheme, NeedsAPlayRadiusForHysteresis) {
    Scheme scheme;
    EXPECT_EQ(refused(scheme, lossy(5.0, 0.1, {})),
              "play_radius is 0, but the model does not define one: must be > 0");
    EXPECT_EQ(refused(scheme, lossy(5.0, 0.1, 0.01)), "");
    scheme.play_radius = 1e-6;
    EXPECT_EQ(refused(scheme, lossy(5.0, 0.1, {})), "");
}

TEST(Scheme, RefusesACompensationThatIsNotPossible) {
    Scheme scheme;
    scheme.compensated = true;
    EXPECT_EQ(refused(scheme, linear_model(89.9)), "");
    EXPECT_EQ(
        refused(scheme, linear_model(92.0)),
        "coupling_stiffness is 100, must be at least 102.2 to compensate a model whose steepest slope is "
        "92");
    EXPECT_EQ(refused(scheme, lossy(5.0, 0.1, 0.01)),
              "compensated is set for a hysteresis model, whose slope has no bound while it sticks");
    EXPECT_EQ(refused(scheme, linear_model(-89.9)), "");
    EXPECT_NE(refused(scheme, linear_model(-92.0)), "") << "outside the domain its force rises by as much";
    scheme.coupling.stiffness = 0.5;
    EXPECT_EQ(refused(scheme, linear_model(0.4)), "");
    scheme.structure = StructureKind::Direct;
    EXPECT_EQ(refused(scheme, linear_model(0.1)),
              "compensated is set for the direct structure, which has no coupling");
}

// A plan limits the slopes of a model to the proved bound of the certificate. A wider bound here would refuse this plan.
TEST(Scheme, CompensationIsRefusedExactlyBeyondTheCertifiedSlope) {
    test::Random random{5};
    for (int k = 0; k < test::cases(50); ++k) {
        NetworkParameters network = test::random_network(random, 1 + random() % 6);
        network.bias += k % 2 == 0 ? 0.0 : 20.0;  // the continuation is then the steepest part
        const ForceModel model{network, test::unit_domain()};
        const double steepest = force_bounds(model).slope.upper;
        Scheme scheme;
        scheme.compensated = true;
        scheme.coupling.stiffness = steepest / compensated_share;
        while (compensated_share * scheme.coupling.stiffness >= steepest) {
            scheme.coupling.stiffness = std::nextafter(scheme.coupling.stiffness, 0.0);
        }
        EXPECT_NE(refused(scheme, model), "") << k;
        scheme.coupling.stiffness = std::nextafter(scheme.coupling.stiffness, 1e9);
        EXPECT_EQ(refused(scheme, model), "") << k;
    }
}

TEST(Scheme, SteepestSlopeIsThatOfTheRenderedForce) {
    Scheme scheme;
    EXPECT_NEAR(steepest_slope(scheme, linear_model(45.0)), 45.0, 1e-9);
    EXPECT_NEAR(steepest_slope(scheme, linear_model(-45.0)), 45.0, 1e-9) << "of its continuation";
    EXPECT_NEAR(steepest_slope(scheme, lossy(5.0, 0.1, 0.02)), 5.0 + 5.0, 1e-6);
    scheme.play_radius = 0.05;
    EXPECT_NEAR(steepest_slope(scheme, lossy(5.0, 0.1, 0.02)), 5.0 + 2.0, 1e-6) << "of the scheme";
    EXPECT_NEAR(steepest_slope(scheme, lossy(5.0, 0.1, {})), 5.0 + 2.0, 1e-6);
    scheme = {};
    scheme.compensated = true;
    EXPECT_NEAR(steepest_slope(scheme, linear_model(80.0)), 400.0, 1e-6) << "1/80 - 1/100 = 1/400";
}

TEST(Scheme, RefusalOfADivergingSchemeNamesItsLimit) {
    Scheme scheme = scheme_of(StructureKind::Explicit);
    const auto at = [&](double stiffness) {
        return refusal([&] { validate(scheme, linear_model(stiffness), scheme_period); });
    };
    // (4 m - 2 (B_o + B_c) T) / T^2 - K_c = (0.004 - 0.00104) / 1e-6 - 100
    EXPECT_EQ(at(2859.0), "");
    EXPECT_EQ(
        at(2861.0),
        "structure is explicit, which diverges: the model's steepest slope is 2861, must be below 2860; "
        "the implicit structure has no such limit");
    EXPECT_NE(refusal([&] { validate(scheme, lossy(5.0, 0.1, {}), scheme_period); }), "")
        << "also the other rules";
}

/// Calls `visit` with the structure of a scheme for an exact environment, without tables.
template <class E>
auto exact(const E& environment, const Scheme& scheme, double force_limit, double width, auto visit) {
    switch (scheme.structure) {
        case StructureKind::Direct:
            return scheme.predict > 0 ? visit(PredictedDirect{environment, scheme.predict})
                                      : visit(Direct{environment});
        case StructureKind::Massless:
            return visit(Massless{LimitedEnvironment{environment, force_limit}, scheme.coupling,
                                  scheme_period, LimitedResolvent{LoadLineSolver{}}});
        case StructureKind::Implicit:
            return visit(
                Implicit<E>{environment, scheme.inertia, scheme.coupling, scheme_period, {}, force_limit});
        case StructureKind::Explicit:
            return visit(Explicit{environment, scheme.inertia, scheme.coupling, scheme_period});
        case StructureKind::Tangent:  // the force of a tangent is that of direct rendering
            return visit(Direct{environment});
        case StructureKind::EnergyConsistent:
            return visit(EnergyConsistent{environment, scheme.inertia, scheme.coupling, scheme_period,
                                          1e-2 * width, true, force_limit});
    }
}

/// Moves two structures together; returns the number of steps with a limited force.
template <class A, class B>
int expect_equal_forces(A prepared, B reference, const std::string& name) {
    test::Random random{5};
    prepared.reset(0.3);
    reference.reset(0.3);
    int limited = 0;
    double x = 0.3;
    for (int k = 0; k < 600; ++k) {
        x = std::clamp(x + test::uniform(random, -0.03, 0.03) + 0.02 * std::sin(0.05 * k), -0.2, 1.2);
        const Rendered expected = reference.step(x);
        const Rendered now = prepared.step(x);
        EXPECT_NEAR(now.force, expected.force, 1e-6) << name << ", tick " << k;
        EXPECT_NEAR(now.environment_position, expected.environment_position, 1e-7) << name << ", tick " << k;
        EXPECT_EQ(now.status, expected.status) << name << ", tick " << k;
        EXPECT_EQ(now.extrapolated, expected.extrapolated) << name << ", tick " << k;
        limited += now.status == Status::Limited ? 1 : 0;
        if (testing::Test::HasFailure()) {
            break;
        }
    }
    return limited;
}

// `make_structure` prepares polynomials and tables. The forces are those of the exact model and of Newton's method.
TEST(Scheme, PreparedStructureGivesTheForcesOfTheExactModel) {
    const NetworkParameters network{1, {4.0, 40.0}, {0.5, 0.2}, {0.2, 0.05}, {8.0}, 0.1};
    const ForceModel plain{network, test::unit_domain()};
    const ForceModel bump{{1, {40.0}, {0.5}, {1.0}, {8.0}, 0.0}, test::unit_domain()};
    const ForceModel loss{network, {{0.02, 0.01}, 0.0, 0.2}, test::unit_domain(), 0.05};
    for (std::size_t k = 0; k < structure_names.size(); ++k) {
        const auto kind = static_cast<StructureKind>(k);
        for (const double limit : {2.0, 1e6, infinity}) {
            Scheme scheme = scheme_of(kind);
            scheme.inertia.damping = 0.1;
            int limited = 0;
            const auto compare = [&](const auto& environment, const ForceModel& model, const Scheme& chosen,
                                     const std::string& name) {
                exact(environment, chosen, limit, model.finest_width(), [&](auto reference) {
                    limited +=
                        expect_equal_forces(make_structure(model, chosen, scheme_period, limit),
                                            std::move(reference), std::string(structure_names[k]) + name);
                });
            };
            compare(*plain.network(), plain, scheme, "");
            if (kind == StructureKind::Tangent) {
                EXPECT_EQ(limited, 0) << "the controller limits the line";
            } else if (kind == StructureKind::Direct) {
                for (const int predict : {1, 3}) {
                    scheme.predict = predict;
                    compare(*plain.network(), plain, scheme, ", predicted");
                }
                scheme.predict = 0;
                EXPECT_EQ(limited, 0) << "the guards limit this structure";
            } else {
                Scheme light = scheme;
                light.inertia = {1e-6, 0.0};
                if (kind == StructureKind::EnergyConsistent) {
                    compare(*bump.network(), bump, light, ", steps across a bump");
                }
                scheme.compensated = true;
                compare(Compensated{*plain.network(), scheme.coupling.stiffness}, plain, scheme,
                        ", compensated");
                scheme.compensated = false;
            }
            compare(*loss.hysteresis(), loss, scheme, ", hysteresis");
            const bool has_limit = limit < 10.0 && !holds_line(kind) && kind != StructureKind::Direct &&
                                   kind != StructureKind::Explicit;
            EXPECT_EQ(limited > 100, has_limit) << structure_names[k] << " " << limited;
        }
    }
}

TEST(Scheme, StructureOfARefusedSchemeIsNotBuilt) {
    Scheme scheme = scheme_of(StructureKind::Direct);
    const auto build = [&] { (void)make_structure(linear_model(5.0), scheme, scheme_period, infinity); };
    EXPECT_EQ(refusal(build), "");
    scheme.predict = 17;
    EXPECT_EQ(refusal(build), "predict is 17, must be 0 to 16");
}

TEST(Scheme, NamesTheSolverOfItsLoadLine) {
    test::Random random{2};
    const ForceModel model{{1, {4.0, 9.0}, {0.5, 0.2}, {0.2, 0.05}, {8.0}, 0.1}, test::unit_domain()};
    EXPECT_EQ(solver_name(model, scheme_of(StructureKind::Direct), scheme_period), std::nullopt);
    EXPECT_EQ(solver_name(model, scheme_of(StructureKind::Explicit), scheme_period), std::nullopt);
    for (const StructureKind kind :
         {StructureKind::Massless, StructureKind::Implicit, StructureKind::EnergyConsistent}) {
        EXPECT_EQ(solver_name(model, scheme_of(kind), scheme_period), "table") << name_of(kind);
    }
    // The force falls with slope -8000 at each position, so no load line of this scheme has exactly one solution
    EXPECT_EQ(solver_name(linear_model(-8000.0), scheme_of(StructureKind::Massless), scheme_period),
              "newton");
}

}  // namespace
}  // namespace palpate
