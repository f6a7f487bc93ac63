// SPDX-License-Identifier: Apache-2.0
// Tests the check of stored certificates: the check recomputes every number, and accepts bounds of the force only if
// they are at least as wide as the recomputed bounds.
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/stability/certificate_check.hpp"
#include "support.hpp"

namespace palpate {
namespace {

ForceModel hysteretic() {
    test::Random random{5};
    const NetworkParameters network = test::random_network(random, 4);
    HysteresisParameters hysteresis;
    hysteresis.weight.assign(4, 0.0);
    hysteresis.bias = 0.05;
    return {network, hysteresis, test::unit_domain(), 0.02};
}

Scheme direct() {
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    return scheme;
}

/// Returns a device that satisfies the certificates of all models in this file.
DeviceProfile strong() {
    DeviceProfile device;
    device.viscous_damping = 1e4;
    device.coulomb_friction = 1e4;
    device.jitter_s = 1e-4;
    return device;
}

/// Returns the message with which `checked` refuses a stored certificate; empty if it accepts the certificate.
std::string disagreement(const Certificate& stored, const ForceModel& model) {
    try {
        (void)checked(stored, model);
        return "";
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
}

/// Returns a copy of a certificate that is computed again from its force bounds after `change` has changed these
/// bounds.
Certificate with_bounds(const Certificate& certificate, const std::function<void(ForceBounds&)>& change) {
    ForceBounds bounds = certificate.bounds;
    change(bounds);
    Certificate changed = certify_rendered(bounds, certificate.scheme, certificate.device);
    changed.model = certificate.model;
    changed.fingerprint = fingerprint_of(changed);
    return changed;
}

const std::vector<std::pair<std::string, std::function<void(ForceBounds&, double)>>> wider{
    {"slope_min", [](ForceBounds& b, double by) { b.slope.lower -= by; }},
    {"slope_max", [](ForceBounds& b, double by) { b.slope.upper += by; }},
    {"steepest", [](ForceBounds& b, double by) { b.steepest += by; }},
    {"sliding", [](ForceBounds& b, double by) { b.sliding += by; }},
    {"loss_min", [](ForceBounds& b, double by) { b.hysteresis_force.lower -= by; }},
    {"loss_max", [](ForceBounds& b, double by) { b.hysteresis_force.upper += by; }},
    {"loss_per_play", [](ForceBounds& b, double by) { b.hysteresis_per_play += by; }},
    {"mean_force", [](ForceBounds& b, double by) { b.mean_force += by; }},
};

TEST(CertificateCheck, AcceptsAComputedCertificate) {
    const ForceModel model = hysteretic();
    EXPECT_EQ(disagreement(certify(model, direct(), strong()), model), "");
}

// An older release computed wider bounds of the force; certificates with wider bounds remain valid.
TEST(CertificateCheck, AcceptsWiderBoundsAndRefusesNarrowerOnes) {
    const ForceModel model = hysteretic();
    const Certificate certificate = certify(model, direct(), strong());
    ASSERT_TRUE(certificate.certified()) << certificate.reason;
    for (const auto& [name, widen] : wider) {
        const auto by = [&widen = widen](double amount) {
            return [&widen, amount](ForceBounds& bounds) { widen(bounds, amount); };
        };
        EXPECT_EQ(disagreement(with_bounds(certificate, by(1e-3)), model), "") << name;
        if (name != "mean_force") {  // the mean force of this model is 0 and cannot be smaller
            const std::string wrong = disagreement(with_bounds(certificate, by(-1e-3)), model);
            EXPECT_EQ(wrong.rfind("certificate.bounds." + name + " is ", 0), 0U) << name << ": " << wrong;
        }
    }
}

TEST(CertificateCheck, RefusesABoundThatIsNotANumber) {
    const ForceModel model = hysteretic();
    const Certificate certificate = certify(model, direct(), strong());
    for (const double none :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
        for (const auto& [name, widen] : wider) {
            const Certificate changed =
                with_bounds(certificate, [&widen = widen, none](ForceBounds& b) { widen(b, none); });
            EXPECT_NE(disagreement(changed, model), "") << name;
        }
    }
    EXPECT_FALSE(agree(1.0, std::numeric_limits<double>::infinity()));
    EXPECT_FALSE(agree(std::numeric_limits<double>::quiet_NaN(), 1.0));
}

// Replaces the bounds by wider ones but keeps the inequalities of the narrower bounds. The check must refuse, because
// the inequalities must follow from the stored bounds.
TEST(CertificateCheck, RefusesLinesThatDoNotFollowFromTheStoredBounds) {
    const ForceModel model = hysteretic();
    Certificate certificate = certify(model, direct(), strong());
    certificate.bounds.slope.upper += 1.0;
    const std::string wrong = disagreement(certificate, model);
    EXPECT_EQ(wrong.rfind("certificate.inequalities[1].right is ", 0), 0U) << wrong;
}

TEST(CertificateCheck, RefusesABoundTooWideForACertificate) {
    const ForceModel model = hysteretic();
    const Certificate certificate = certify(model, direct(), strong());
    Certificate weak = with_bounds(certificate, [](ForceBounds& bounds) { bounds.slope.upper = 1e9; });
    weak.verdict = Verdict::Certified;
    const std::string wrong = disagreement(weak, model);
    EXPECT_EQ(wrong.rfind("certificate.verdict is ", 0), 0U) << wrong;
}

TEST(CertificateCheck, RefusesAStoredRefusalWithTheVerdictsThatAreAllowed) {
    const ForceModel model = hysteretic();
    DeviceProfile loose = strong();
    loose.viscous_damping = 1e-9;
    const Certificate refused = certify(model, direct(), loose);
    ASSERT_EQ(refused.verdict, Verdict::Refused);
    const std::string wrong = disagreement(refused, model);
    const std::string expected =
        "certificate.verdict is \"refused\": must be \"certified\" or \"stable-locally\", ";
    EXPECT_EQ(wrong.rfind(expected, 0), 0U) << wrong;
}

TEST(CertificateCheck, RefusesAnEditedDeviceEvenIfNoLineUsesTheField) {
    const ForceModel model = hysteretic();
    const Certificate certificate = certify(model, direct(), strong());
    const auto refused = [&](const std::function<void(DeviceProfile&)>& change) {
        Certificate edited = certificate;
        change(edited.device);
        return disagreement(edited, model).rfind("certificate.fingerprint is ", 0) == 0;
    };
    EXPECT_TRUE(refused([](auto& d) { d.id = "other"; }));
    EXPECT_TRUE(refused([](auto& d) { d.position_unit = "m"; }));
    EXPECT_TRUE(refused([](auto& d) { d.inertia *= 2.0; }));
    EXPECT_TRUE(refused([](auto& d) { d.force_limit *= 2.0; }));
    EXPECT_TRUE(refused([](auto& d) { d.delay_s = 1e-15; }));
}

TEST(CertificateCheck, AcceptsRoundingOfAnotherMachine) {
    const ForceModel model = hysteretic();
    Certificate stored = certify(model, direct(), strong());
    for (Inequality& line : stored.inequalities) {
        line.right *= 1.0 + 1e-15;
    }
    stored.longest_period_s *= 1.0 + 1e-15;
    stored.fingerprint = fingerprint_of(stored);
    EXPECT_EQ(disagreement(checked(stored, model), model), "");
}

TEST(CertificateCheck, DoesNotCompareTexts) {
    const ForceModel model = hysteretic();
    Certificate stored = certify(model, direct(), strong());
    const Certificate before = stored;
    stored.reason = "";
    for (Inequality& line : stored.inequalities) {
        line.name = line.formula = line.source = "";
    }
    EXPECT_EQ(checked(stored, model).reason, before.reason);
    EXPECT_EQ(checked(stored, model).inequalities[1].formula, before.inequalities[1].formula);
}

TEST(CertificateCheck, NamesTheFirstFieldInWhichADeviceDiffers) {
    const DeviceProfile device = strong();
    EXPECT_EQ(device_difference(device, device), "");
    const auto difference = [&](const std::function<void(DeviceProfile&)>& change) {
        DeviceProfile other = device;
        change(other);
        return device_difference(device, other);
    };
    const auto names = [](const std::string& sentence, const char* field) {
        return sentence.find(field) != std::string::npos;
    };
    EXPECT_TRUE(names(difference([](auto& d) { d.id = "other"; }), "not for other"));
    EXPECT_TRUE(names(difference([](auto& d) { d.period_s *= 1.001; }), "period_s"));
    EXPECT_TRUE(names(difference([](auto& d) { d.viscous_damping *= 1.001; }), "viscous_damping"));
    EXPECT_TRUE(names(difference([](auto& d) { d.delay_s = d.period_s; }), "delay_s"));
    EXPECT_TRUE(names(difference([](auto& d) { d.position_unit = "m"; }), "in rad"));
    EXPECT_EQ(difference([](auto& d) { d.on_device = OnDevice{.delay_s = 1e-4}; }), "");
    EXPECT_TRUE(names(difference([](auto& d) { d = on_device(d, 4e4); }),
                      "with the model on the host at 1000 Hz, not on its motor controller at 40000 Hz"));
}

TEST(CertificateCheck, AnEditedRendererIsRefused) {
    const ForceModel model = hysteretic();
    DeviceProfile device = strong();
    device.on_device = OnDevice{.delay_s = 1e-5};
    const Certificate stored = certify(model, direct(), on_device(device, 4e4));
    EXPECT_EQ(stored.device.renderer, "device");
    EXPECT_EQ(stored.device.on_device, std::nullopt);
    EXPECT_NO_THROW((void)checked(stored, model));
    Certificate edited = stored;
    edited.device.renderer.reset();
    EXPECT_THROW((void)checked(edited, model), std::invalid_argument);
}

}  // namespace
}  // namespace palpate
