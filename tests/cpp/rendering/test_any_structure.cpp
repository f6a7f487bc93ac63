// SPDX-License-Identifier: Apache-2.0
#include "palpate/rendering/any_structure.hpp"

#include <cmath>
#include <optional>
#include <utility>

#include <gtest/gtest.h>

#include "palpate/rendering/direct.hpp"
#include "palpate/rendering/implicit.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "support.hpp"

namespace palpate {
namespace {

Implicit<test::Spring> object() {
    return Implicit{test::Spring{2.0}, Inertia{0.01, 0.1}, VirtualCoupling{50.0, 0.01}, 1e-3};
}

void expect_same(const Rendered& a, const Rendered& b) {
    EXPECT_EQ(a.force, b.force);
    EXPECT_EQ(a.environment_position, b.environment_position);
    EXPECT_EQ(a.evaluations, b.evaluations);
    EXPECT_EQ(a.status, b.status);
    EXPECT_EQ(a.extrapolated, b.extrapolated);
}

TEST(AnyStructure, RendersTheForcesOfTheStructureThatItHolds) {
    Implicit<test::Spring> alone = object();
    AnyStructure any{object()};
    alone.reset(0.3);
    any.reset(0.3);
    for (int k = 0; k < 100; ++k) {
        const double x = 0.3 + 0.1 * std::sin(0.1 * k);
        expect_same(any.step(x), alone.step(x));
        expect_same(any.drive(0.5), alone.drive(0.5));
    }
}

TEST(AnyStructure, CopyMovesIndependently) {
    AnyStructure first{object()};
    first.reset(0.0);
    (void)first.step(0.2);
    AnyStructure copy{first};
    AnyStructure assigned{Direct{test::Spring{1.0}}};
    assigned = first;
    const Rendered next = first.step(0.4);
    for (int k = 0; k < 10; ++k) {
        (void)first.step(-1.0);
    }
    expect_same(copy.step(0.4), next);
    expect_same(assigned.step(0.4), next);
}

TEST(AnyStructure, RefusesToDriveAnObjectWithoutMass) {
    AnyStructure direct{Direct{test::Spring{2.0}}};
    const Rendered refused = direct.drive(1.0);
    EXPECT_EQ(refused.force, 0.0);
    EXPECT_EQ(refused.status, Status::NonFinite);
}

TEST(AnyStructure, KnowsWhetherItsLoadLinesAreTabulated) {
    EXPECT_EQ(AnyStructure{Direct{test::Spring{2.0}}}.tabulated(), std::nullopt);
    EXPECT_EQ(AnyStructure{object()}.tabulated(), false);
    const ForceModel model{{1, {4.0, 9.0}, {0.5, 0.2}, {0.2, 0.05}, {8.0}, 0.1}, test::unit_domain()};
    EXPECT_EQ(make_structure(model, Scheme{}, 1e-3, 50.0).tabulated(), true);
}

}  // namespace
}  // namespace palpate
