// SPDX-License-Identifier: Apache-2.0
// Tests the check of stored certificates: the check recomputes every number, and accepts bounds of the force only if
// they are at least as wide as the recomputed bounds.
#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
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
    return test::refusal([&] { (void)checked(stored, model); });
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
    EXPECT_EQ(wrong.rfind("certificate.verdict is \"certified\": must be \"refused\", ", 0), 0U) << wrong;
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

TEST(CertificateCheck, NumbersAgreeToABillionthOfTheLargerOne) {
    for (const double sign : {-1.0, 1.0}) {
        EXPECT_TRUE(agree(sign * 1.0, sign * (1.0 + 0.99e-9)));
        EXPECT_TRUE(agree(sign * (1.0 + 0.99e-9), sign * 1.0));
        EXPECT_FALSE(agree(sign * 1.0, sign * (1.0 + 1.01e-9)));
        EXPECT_FALSE(agree(sign * (1.0 + 1.01e-9), sign * 1.0));
    }
    EXPECT_TRUE(agree(0.0, 0.0));
    EXPECT_FALSE(agree(0.0, 1e-300));
    EXPECT_FALSE(agree(1.0, -1.0));
    const double infinite = std::numeric_limits<double>::infinity();
    EXPECT_FALSE(agree(infinite, infinite));
    const std::optional<double> none;
    EXPECT_TRUE(agree(none, none));
    EXPECT_FALSE(agree(std::optional{1.0}, none));
    EXPECT_FALSE(agree(none, std::optional{1.0}));
    EXPECT_TRUE(agree(std::optional{1.0}, std::optional{1.0}));
    EXPECT_FALSE(agree(std::optional{1.0}, std::optional{2.0}));
}

TEST(CertificateCheck, MessagesNameFieldValueAndRule) {
    EXPECT_EQ(
        detail::disagrees("device.delay_s", 0.5, 0.25),
        "certificate.device.delay_s is 0.5: must be 0.25, computed from model and device; plan the model "
        "again");
    ForceBounds stored;
    ForceBounds now;
    now.slope = {-2.0, 3.0};
    stored.slope = {-1.0, 3.0};
    EXPECT_EQ(detail::narrower_bound(stored, now),
              "certificate.bounds.slope_min is -1: must be at most -2, computed from model and device; plan "
              "the model again");
    stored.slope = {-2.5, 2.0};
    EXPECT_EQ(
        detail::narrower_bound(stored, now),
        "certificate.bounds.slope_max is 2: must be at least 3, computed from model and device; plan the "
        "model again");
    stored.slope = {-1.0, 2.0};
    EXPECT_NE(detail::narrower_bound(stored, now).find("slope_min"), std::string::npos) << "the first one";
    stored.slope = {-2.0 * (1.0 - 1e-10), 3.0 * (1.0 - 1e-10)};
    EXPECT_EQ(detail::narrower_bound(stored, now), "");
    const double infinite = std::numeric_limits<double>::infinity();
    stored.slope = now.slope = {-infinite, infinite};
    EXPECT_EQ(detail::narrower_bound(stored, now), "");
    now.hysteresis = true;
    EXPECT_NE(detail::narrower_bound(stored, now), "");
    Inequality line;
    line.id = "one";
    line.left = 1.0;
    line.right = 0.5;
    Inequality other = line;
    EXPECT_EQ(detail::line_disagrees("inequalities[2]", line, other), "");
    other.id = "two";
    EXPECT_EQ(detail::line_disagrees("inequalities[2]", line, other),
              "certificate.inequalities[2].id is \"one\": must be \"two\"");
    other = line;
    other.left = 2.0;
    EXPECT_EQ(detail::line_disagrees("lines", line, other),
              "certificate.lines.left is 1: must be 2, computed from model and device; plan the model again");
    other = line;
    other.right = 0.25;
    EXPECT_EQ(detail::line_disagrees("lines", line, other),
              "certificate.lines.right is 0.5: must be 0.25, computed from model and device; plan the model "
              "again");
}

TEST(CertificateCheck, NamesTheFirstDifferenceOfAStoredCertificate) {
    const ForceModel model = hysteretic();
    const Certificate certificate = certify(model, direct(), strong());
    const auto refusal = [&](const std::function<void(Certificate&)>& change) {
        Certificate edited = certificate;
        change(edited);
        return disagreement(edited, model);
    };
    const auto starts = [&](const std::function<void(Certificate&)>& change, const std::string& text) {
        const std::string wrong = refusal(change);
        EXPECT_EQ(wrong.substr(0, text.size()), text);
    };
    starts(
        [](auto& c) { c.model = "0123456789abcdef"; },
        "certificate.model is \"0123456789abcdef\": must be \"" + certificate.model + "\", the fingerprint");
    starts([](auto& c) { c.device.period_s = -1.0; },
           "certificate has an invalid plan: device profile: period_s is -1");
    starts([](auto& c) { c.scheme.predict = 99; }, "certificate has an invalid plan: predict is 99");
    starts([](auto& c) { c.inequalities.pop_back(); }, "certificate.inequalities has 2 lines: must have 3");
    starts([](auto& c) { c.inequalities.emplace_back(); },
           "certificate.inequalities has 4 lines: must have 3");
    starts([](auto& c) { c.inequalities[0].id = "x"; }, "certificate.inequalities[0].id is \"x\"");
    starts([](auto& c) { c.inequalities[2].left *= 1.1; }, "certificate.inequalities[2].left is ");
    starts([](auto& c) { c.longest_period_s *= 1.1; }, "certificate.longest_period_s is ");
    starts([](auto& c) { c.fingerprint = "0"; },
           "certificate.fingerprint is \"0\": must be \"" + certificate.fingerprint + "\"; the certificate");
    starts([](auto& c) { c.verdict = Verdict::Refused; },
           "certificate.verdict is \"refused\": must be \"certified\", every inequality");
    starts([](auto& c) { c.verdict = Verdict::StableLocally; },
           "certificate.verdict is \"stable-locally\": must be \"certified\", every inequality");
}

TEST(CertificateCheck, KeepsTheStoredNumbers) {
    const ForceModel model = hysteretic();
    Certificate stored = certify(model, direct(), strong());
    for (Inequality& line : stored.inequalities) {
        line.left *= 1.0 + 1e-15;
        line.right *= 1.0 + 1e-15;
    }
    stored.longest_period_s *= 1.0 + 1e-15;
    stored.fingerprint = fingerprint_of(stored);
    const Certificate now = checked(stored, model);
    EXPECT_EQ(now.model, stored.model);
    EXPECT_EQ(now.fingerprint, stored.fingerprint);
    EXPECT_EQ(now.longest_period_s, stored.longest_period_s);
    for (std::size_t k = 0; k < now.inequalities.size(); ++k) {
        EXPECT_EQ(now.inequalities[k].left, stored.inequalities[k].left);
        EXPECT_EQ(now.inequalities[k].right, stored.inequalities[k].right);
    }
}

TEST(CertificateCheck, StatesBothValuesOfADeviceThatDiffers) {
    const DeviceProfile device = strong();
    const auto difference = [&](const std::function<void(DeviceProfile&)>& change) {
        DeviceProfile other = device;
        change(other);
        return device_difference(device, other);
    };
    EXPECT_EQ(
        difference([](auto& d) { d.id = "other"; }),
        "the certificate is for the device simulated-knob, not for other; plan the model again for this "
        "device");
    EXPECT_EQ(
        difference([](auto& d) {
            d.id = "other";
            d.renderer = "device";
        }),
        "the certificate is for the device simulated-knob, not for other; plan the model again for this "
        "device");
    EXPECT_EQ(difference([](auto& d) { d.position_unit = "m"; }),
              "the certificate is for the device simulated-knob in rad, not in m");
    EXPECT_EQ(difference([](auto& d) { d.force_limit = 4.0; }),
              "the certificate is for the device simulated-knob with force_limit = 5, not 4; plan the model "
              "again");
    EXPECT_EQ(
        difference([](auto& d) {
            d.period_s = 2e-3;
            d.force_limit = 4.0;
        }),
        "the certificate is for the device simulated-knob with period_s = 0.001, not 0.002; plan the model "
        "again");
    EXPECT_EQ(difference([](auto& d) { d.force_limit *= 1.0 + 1e-10; }), "");
    EXPECT_EQ(
        difference([](auto& d) { d.renderer = "device"; }),
        "the certificate is for the device simulated-knob with the model on the host at 1000 Hz, not on its "
        "motor controller at 1000 Hz; plan the model again");
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
    edited.device.renderer = "other";
    EXPECT_NE(fingerprint_of(edited), fingerprint_of(stored));
}

}  // namespace
}  // namespace palpate
