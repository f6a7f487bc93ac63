// SPDX-License-Identifier: Apache-2.0
#include "palpate/stability/account_certificate.hpp"

#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "palpate/model/force_model.hpp"
#include "palpate/stability/certificate_check.hpp"
#include "support.hpp"

namespace palpate {
namespace {

ForceModel wall_of(double stiffness, double travel = 0.1) {
    return {NetworkParameters{1, {}, {}, {}, {stiffness}, 0.0},
            {{0.0}, {travel}, Continuation::Linear, Continuation::Linear, std::nullopt}};
}

Scheme directly() {
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    return scheme;
}

TEST(AccountCertificate, HoldsAWallThatIsTooStiffForAProof) {
    const DeviceProfile device;
    const ForceModel model = wall_of(250.0);
    ASSERT_FALSE(certify(model, directly(), device).certified());
    const Certificate held = certify_with_account(model, directly(), device);
    EXPECT_EQ(held.verdict, Verdict::HeldByAccount) << held.reason;
    EXPECT_FALSE(held.certified());
    EXPECT_EQ(held.longest_period_s, device.longest_period_s());
    const double stored = largest_stored_energy(model, directly(), device.force_limit);
    EXPECT_EQ(held.reason, "a hand takes at most E_0 = " + readable(stored) + " J, by the energy account");
    ASSERT_EQ(held.inequalities.size(), 1U);
    EXPECT_EQ(held.inequalities[0].left, 2.0 * stored);
    const double counted = uncertified_credit * device.viscous_damping / device.period_s;
    EXPECT_NEAR(held.inequalities[0].right, 25.0 / (4.0 * counted), 1e-12);
}

TEST(AccountCertificate, RefusesAForceThatTheAccountCannotHoldAtRest) {
    const Certificate refused = certify_with_account(wall_of(250.0, 0.01), directly(), [] {
        DeviceProfile device;
        device.viscous_damping = 1e-3;
        return device;
    }());
    EXPECT_EQ(refused.verdict, Verdict::Refused);
    EXPECT_EQ(refused.reason.rfind("energy account against the largest force: 2 W >= E_F needs ", 0), 0U)
        << refused.reason;
    EXPECT_EQ(refused.longest_period_s, 0.0);
}

TEST(AccountCertificate, RefusesAModelWithoutABoundOfItsEnergy) {
    const ForceModel motor{NetworkParameters{1, {}, {}, {}, {0.0}, 1.0}, {{0.0}, {1.0}, {}, {}, 1.0}};
    EXPECT_EQ(certify_with_account(motor, directly(), {}).verdict, Verdict::Refused);
}

TEST(AccountCertificate, RefusesAModelOnAMotorController) {
    const Certificate refused =
        certify_with_account(wall_of(250.0), directly(), on_device(DeviceProfile{}, 1000.0));
    EXPECT_EQ(refused.verdict, Verdict::Refused);
}

TEST(AccountCertificate, AStoredOneIsComputedAgain) {
    const ForceModel model = wall_of(250.0);
    const Certificate held = certify_with_account(model, directly(), {});
    const Certificate again = checked(held, model);
    EXPECT_EQ(again.verdict, Verdict::HeldByAccount);
    EXPECT_EQ(again.fingerprint, held.fingerprint);
    Certificate edited = held;
    edited.verdict = Verdict::Certified;
    EXPECT_THROW((void)checked(edited, model), std::invalid_argument)
        << "nothing is proved without the account";
    edited = held;
    edited.inequalities[0].left *= 1.01;
    EXPECT_THROW((void)checked(edited, model), std::invalid_argument);
    edited = held;
    edited.device.viscous_damping *= 2.0;
    EXPECT_THROW((void)checked(edited, model), std::invalid_argument);
}

}  // namespace
}  // namespace palpate
