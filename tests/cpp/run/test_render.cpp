// SPDX-License-Identifier: Apache-2.0
#include "palpate/run/detail/render.hpp"

#include <stdlib.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "moved_device.hpp"
#include "palpate/io/model_file.hpp"
#include "palpate/simulation/simulated_device.hpp"
#include "palpate/simulation/test_rig.hpp"
#include "palpate/stability/account_certificate.hpp"
#include "support.hpp"

namespace palpate {
namespace {

PlannedModel stored(const std::string& name) {
    const std::string path = PALPATE_SOURCE_DIR "/tests/models/good/" + name;
    ModelFile file = load_model_file(path);
    return {path,
            std::move(file.model),
            std::move(file.position_unit),
            std::move(file.force_unit),
            std::move(file.plan),
            std::move(file.limited),
            std::move(file.certificate)};
}

RenderJob prepared(const PlannedModel& model, const DeviceProfile& profile, bool simulated,
                   const RenderOptions& options) {
    LiveDeviceOf<SimulatedDevice> device{SimulatedDevice{profile, Hand{}}};
    device.profile = profile;
    device.scale = scale_of(model.model, true);
    device.rate_hz = 1.0 / profile.period_s;
    device.simulated = simulated;
    RecordSinks sinks;
    return prepare_rendering(options, model, device, sinks);
}

/// Prepares a rendering of a stored model on the device of its certificate.
RenderJob prepared(const PlannedModel& model, bool simulated, const RenderOptions& options) {
    return prepared(model, model.certificate->device, simulated, options);
}

std::string certified(const RenderJob& job) {
    const auto found = std::find_if(job.metadata.begin(), job.metadata.end(),
                                    [](const auto& item) { return item.first == "certified"; });
    return found == job.metadata.end() ? "" : found->second;
}

TEST(PrepareRendering, UsesTheProofsOfACertifiedPlan) {
    const PlannedModel model = stored("certificate_massless.json");
    const RenderJob job = prepared(model, true, {});
    EXPECT_TRUE(job.guards.certified);
    EXPECT_EQ(job.guards.slew_s, 0.0);
    EXPECT_EQ(certified(job), "certified");
    EXPECT_TRUE(job.notes.empty());
    EXPECT_TRUE(prepared(model, false, {}).guards.certified);
}

TEST(PrepareRendering, KeepsAllGuardsIfThePlanIsOnlyStable) {
    const PlannedModel model = stored("certificate_stable.json");
    ASSERT_EQ(model.certificate->verdict, Verdict::StableLocally);
    const RenderJob job = prepared(model, true, {});
    EXPECT_FALSE(job.guards.certified) << "nothing is proved about the energy";
    EXPECT_EQ(job.guards.slew_s, GuardSettings{}.slew_s);
    EXPECT_EQ(certified(job).rfind("no: the certificate is stable-locally: ", 0), 0U) << certified(job);
    ASSERT_EQ(job.notes.size(), 1U);
    EXPECT_EQ(job.notes.front().rfind("uncertified: the certificate is stable-locally: ", 0), 0U);
}

TEST(PrepareRendering, APlanThatTheAccountHoldsNeedsTheAccount) {
    PlannedModel model = stored("certificate_massless.json");
    model.name = "key.json";
    model.certificate = certify_with_account(model.planned(), *model.plan, model.certificate->device);
    ASSERT_TRUE(model.certificate->held_by_account()) << model.certificate->reason;
    for (const bool simulated : {false, true}) {
        RenderOptions options;
        const RenderJob job = prepared(model, simulated, options);
        EXPECT_FALSE(job.guards.certified) << "the account must count steps and nine tenths of the losses";
        EXPECT_TRUE(job.guards.energy_account);
        EXPECT_EQ(job.guards.slew_s, 0.0);
        EXPECT_EQ(job.session.loop.tolerated, 0U);
        EXPECT_EQ(job.session.loop.longest_period_s, model.certificate->longest_period_s);
        EXPECT_EQ(certified(job), "held-by-account");
        EXPECT_TRUE(job.notes.empty());
        options.energy_account = false;
        if (simulated) {
            EXPECT_EQ(certified(prepared(model, true, options)),
                      "no: it is held by the energy account, which is switched off");
        } else {
            EXPECT_EQ(
                test::refusal([&] { (void)prepared(model, false, options); }),
                "key.json cannot be rendered: it is held by the energy account, which is switched off; make "
                "a certificate with 'palpate plan', or set uncertified to render without a certificate");
        }
    }
}

/// A difference between the device and that of the certificate.
struct Difference {
    const char* name;
    void (*apply)(DeviceProfile& device);
};

/// An option that changes the plan.
struct Change {
    const char* name;
    void (*apply)(RenderOptions& options);
};

TEST(PrepareRendering, NeedsAModelThatItsIdentificationDoesNotRefuse) {
    PlannedModel model = stored("certificate_massless.json");
    model.name = "switch.json";
    model.refusal = "19 % are explained";
    for (const bool simulated : {false, true}) {
        RenderOptions options;
        EXPECT_EQ(test::refusal([&] { (void)prepared(model, simulated, options); }),
                  "the verdict of switch.json is no: 19 % are explained. Identify a better model, or give "
                  "--accept-model to use this one");
        options.accept_model = true;
        EXPECT_TRUE(prepared(model, simulated, options).guards.certified);
    }
}

// A real device moves only if a certificate holds for model, plan and device, or if uncertified is set. The guards rely
// on a certificate only if it holds.
TEST(PrepareRendering, NeedsACertificateThatHoldsOrTheOptionUncertified) {
    const Difference differences[] = {
        {"none", [](DeviceProfile&) {}},
        {"other device", [](DeviceProfile& device) { device.id += "-2"; }},
        {"longer period", [](DeviceProfile& device) { device.period_s *= 1.01; }},
        {"coarser encoder",
         [](DeviceProfile& device) { device.encoder_step = 2.0 * device.encoder_step + 1e-4; }},
        {"weaker motor", [](DeviceProfile& device) { device.force_limit *= 0.5; }},
    };
    const Change changes[] = {
        {"none", [](RenderOptions&) {}},
        {"structure", [](RenderOptions& options) { options.scheme.structure = StructureKind::Implicit; }},
        {"coupling", [](RenderOptions& options) { options.scheme.coupling_stiffness = 50.0; }},
        {"force limit", [](RenderOptions& options) { options.force_limit = 0.1; }},
        {"slew", [](RenderOptions& options) { options.slew_s = 0.0; }},
        {"tolerated samples", [](RenderOptions& options) { options.tolerated = 3; }},
    };
    PlannedModel without = stored("certificate_massless.json");
    const DeviceProfile certified_device = without.certificate->device;
    without.certificate.reset();
    PlannedModel refused = stored("certificate_massless.json");
    refused.certificate->verdict = Verdict::Refused;
    const PlannedModel stable = stored("certificate_stable.json");
    const PlannedModel proved = stored("certificate_massless.json");
    for (const PlannedModel* model :
         std::initializer_list<const PlannedModel*>{&without, &refused, &stable, &proved}) {
        for (const Difference& difference : differences) {
            for (const Change& change : changes) {
                for (const bool simulated : {false, true}) {
                    for (const bool uncertified : {false, true}) {
                        DeviceProfile profile =
                            model->certificate ? model->certificate->device : certified_device;
                        difference.apply(profile);
                        RenderOptions options;
                        options.uncertified = uncertified;
                        change.apply(options);
                        const bool fits = model == &proved && change.name == std::string("none");
                        const bool holds = fits && difference.name == std::string("none");
                        const std::string what = std::string(difference.name) + ", " + change.name +
                                                 (simulated ? ", simulated" : "") +
                                                 (uncertified ? ", uncertified" : "");
                        if (!simulated && !uncertified && !holds) {
                            EXPECT_THROW((void)prepared(*model, profile, simulated, options),
                                         std::invalid_argument)
                                << what;
                            continue;
                        }
                        const RenderJob job = prepared(*model, profile, simulated, options);
                        // A simulated device takes the profile of the certificate when it is opened
                        const bool relies = !uncertified && (simulated ? fits : holds);
                        EXPECT_EQ(job.guards.certified, relies) << what;
                        EXPECT_EQ(certified(job).rfind("no: ", 0) != 0, relies) << what;
                        EXPECT_LE(job.guards.force_limit,
                                  simulated && relies ? certified_device.force_limit : profile.force_limit)
                            << what;
                        EXPECT_EQ(job.session.loop.tolerated == 0, relies) << what;
                    }
                }
            }
        }
    }
}

// ------------------------------------------------------------------------------ models and their options

PlannedModel proved_model() {
    return stored("certificate_massless.json");
}

using test::refusal;

TEST(PlannedModel, StatesItsUnitsAndTheModelOfItsPlan) {
    PlannedModel model = proved_model();
    model.name = "a.json";
    EXPECT_EQ(model.units_text(), "a.json is in rad and N*m");
    EXPECT_EQ(model.units().position, "rad");
    EXPECT_EQ(model.units().force, "Nm");
    model.position_unit.clear();
    EXPECT_EQ(model.units_text(), "a.json is in no unit and N*m");
    model.force_unit.clear();
    EXPECT_EQ(model.units_text(), "a.json is in no unit and no unit");
    EXPECT_EQ(&model.planned(), &model.model);
    model.limited = model.model;
    EXPECT_EQ(&model.planned(), &*model.limited);
}

TEST(RenderOptions, ChangeThePlanIfTheySetOneOfItsNumbers) {
    EXPECT_FALSE(changes_plan({}));
    for (void (*set)(RenderOptions&) : std::initializer_list<void (*)(RenderOptions&)>{
             [](RenderOptions& options) { options.scheme.predict = 2; },
             [](RenderOptions& options) { options.force_limit = 1.0; },
             [](RenderOptions& options) { options.slew_s = 0.0; },
             [](RenderOptions& options) { options.tolerated = 0; }}) {
        RenderOptions options;
        set(options);
        EXPECT_TRUE(changes_plan(options));
    }
    RenderOptions options;
    options.largest_speed = 5.0;
    options.ramp_s = 1.0;
    options.energy_account = false;
    EXPECT_FALSE(changes_plan(options));
}

TEST(RenderOptions, DecideWhetherTheCertificateIsUsed) {
    const PlannedModel proved = proved_model();
    PlannedModel on_device = proved_model();
    on_device.certificate->device.renderer = "device";
    PlannedModel without = proved_model();
    without.certificate.reset();
    RenderOptions uncertified;
    uncertified.uncertified = true;
    RenderOptions changed;
    changed.slew_s = 0.1;

    EXPECT_TRUE(rendered_by_device({}, on_device));
    EXPECT_FALSE(rendered_by_device(uncertified, on_device));
    EXPECT_FALSE(rendered_by_device({}, proved));
    EXPECT_FALSE(rendered_by_device({}, without));

    EXPECT_TRUE(follows_certificate({}, proved));
    EXPECT_FALSE(follows_certificate(uncertified, proved));
    EXPECT_FALSE(follows_certificate(changed, proved));
    EXPECT_FALSE(follows_certificate({}, without));

    EXPECT_EQ(uncertified_reason({}, proved), "");
    EXPECT_EQ(uncertified_reason({}, without), "the model has no certificate");
    EXPECT_EQ(uncertified_reason(uncertified, proved), "uncertified was set");
    EXPECT_EQ(uncertified_reason(changed, proved), "the options change the plan");
    PlannedModel refused = proved_model();
    refused.certificate->verdict = Verdict::Refused;
    refused.certificate->reason = "too steep";
    EXPECT_EQ(uncertified_reason({}, refused), "the certificate is refused: too steep");
}

// ------------------------------------------------------------------------ certificate and device compared

struct Compared {
    PlannedModel model = proved_model();
    RenderOptions options{};
    DeviceProfile device = model.certificate->device;

    [[nodiscard]] std::string mismatch() const {
        return detail::certificate_mismatch(options, model, device);
    }
    DeviceProfile& certified() { return model.certificate->device; }
};

TEST(CertificateMismatch, NamesTheFirstDifference) {
    EXPECT_EQ(Compared{}.mismatch(), "");
    Compared none;
    none.model.certificate.reset();
    EXPECT_EQ(none.mismatch(), "has no certificate");
    Compared refused;
    refused.model.certificate->verdict = Verdict::StableLocally;
    refused.model.certificate->reason = "no proof";
    EXPECT_EQ(refused.mismatch(), "is not certified: no proof");
    Compared other;
    other.device.id = "another";
    EXPECT_EQ(other.mismatch(), "is certified for the device bench-knob, not for another");
    Compared period;
    period.device.period_s = 0.002;
    EXPECT_EQ(period.mismatch(), "is certified for a period of 1 ms, the device has 2 ms");
    period.device.period_s = 0.0005;
    EXPECT_EQ(period.mismatch(), "is certified for a period of 1 ms, the device has 0.5 ms");
    Compared coarse;
    coarse.device.encoder_step = 0.25;
    EXPECT_EQ(coarse.mismatch(),
              "is certified for an encoder step of 9.587e-05 rad, the device has 0.25 rad");
    Compared weak;
    weak.device.force_limit = 2.0;
    EXPECT_EQ(weak.mismatch(), "is certified for a force limit of 5 N*m, the device makes at most 2 N*m");
    Compared changed;
    changed.options.force_limit = 1.0;
    EXPECT_EQ(changed.mismatch(),
              "is certified for its plan only: do not set structure, its numbers, force_limit, slew_s or "
              "tolerated_samples");
}

// A finer encoder and a stronger motor keep the proofs. Numbers that differ by less than 1e-6 of the value of the
// device count as equal.
TEST(CertificateMismatch, ComparesNumbersOnTheUnsafeSideUpToRounding) {
    for (const double rounding : {0.9e-6, 1.1e-6}) {
        const bool equal = rounding < 1e-6;
        for (const double sign : {-1.0, 1.0}) {
            Compared period;
            period.device.period_s *= 1.0 + sign * rounding;
            EXPECT_EQ(period.mismatch().empty(), equal);
            Compared encoder;
            encoder.device.encoder_step *= 1.0 + sign * rounding;
            EXPECT_EQ(encoder.mismatch().empty(), equal || sign < 0.0);
            Compared force;
            force.device.force_limit *= 1.0 + sign * rounding;
            EXPECT_EQ(force.mismatch().empty(), equal || sign > 0.0);
        }
    }
    Compared better;
    better.device.encoder_step *= 0.5;
    better.device.force_limit *= 2.0;
    EXPECT_EQ(better.mismatch(), "");
}

// The model that a device renders contains its encoder step, so a finer encoder is also a difference.
TEST(CertificateMismatch, ComparesOnlyTheEncoderStepOfADeviceThatRenders) {
    Compared on_device;
    on_device.certified().renderer = "device";
    on_device.device.period_s = 0.5;
    EXPECT_EQ(on_device.mismatch(), "");
    on_device.certified().encoder_step = 0.5;
    on_device.device.encoder_step = 0.25;
    EXPECT_EQ(on_device.mismatch(), "is exported for an encoder step of 0.5 rad, the device has 0.25 rad");
    on_device.device.encoder_step = 0.75;
    EXPECT_EQ(on_device.mismatch(), "is exported for an encoder step of 0.5 rad, the device has 0.75 rad");
    on_device.certified().encoder_step = on_device.device.encoder_step = 0.0;
    EXPECT_EQ(on_device.mismatch(), "") << "two encoders without steps are equal";
}

// ------------------------------------------------------------------------------------------------- guards

std::unique_ptr<LiveDeviceOf<test::MovedDevice>> device_at(double position, const DeviceProfile& profile) {
    return test::moved_device({[=](std::uint64_t) { return position; }}, profile);
}

TEST(ChosenGuards, AreThoseOfTheOptionsOtherwiseOfTheDevice) {
    DeviceProfile profile;
    profile.force_limit = 4.0;
    profile.viscous_damping = 0.25;
    const auto device = device_at(0.0, profile);
    device->scale = {2.0, 3.0};
    const GuardSettings usual = guards_for(device->scale, profile);
    const GuardSettings chosen = detail::chosen_guards({}, *device);
    EXPECT_EQ(chosen.force_limit, 4.0);
    EXPECT_EQ(chosen.largest_speed, usual.largest_speed);
    EXPECT_EQ(chosen.slew_s, usual.slew_s);
    EXPECT_EQ(chosen.ramp_s, GuardSettings{}.ramp_s);
    EXPECT_EQ(chosen.frozen_s, GuardSettings{}.frozen_s);
    EXPECT_EQ(chosen.device_damping, 0.25);
    EXPECT_TRUE(chosen.energy_account);

    RenderOptions options;
    options.force_limit = 1.5;
    options.largest_speed = 7.0;
    options.slew_s = 0.125;
    options.ramp_s = 0.75;
    options.frozen_s = 0.5;
    options.energy_account = false;
    const GuardSettings own = detail::chosen_guards(options, *device);
    EXPECT_EQ(own.force_limit, 1.5);
    EXPECT_EQ(own.largest_speed, 7.0);
    EXPECT_EQ(own.slew_s, 0.125);
    EXPECT_EQ(own.ramp_s, 0.75);
    EXPECT_EQ(own.frozen_s, 0.5);
    EXPECT_FALSE(own.energy_account);
}

TEST(ChosenGuards, RefuseAForceThatTheDeviceDoesNotMake) {
    DeviceProfile profile;
    profile.force_limit = 4.0;
    profile.force_step = 0.5;
    const auto device = device_at(0.0, profile);
    RenderOptions options;
    options.force_limit = 4.25;
    EXPECT_EQ(detail::chosen_guards(options, *device).force_limit, 4.0) << "within one force step";
    options.force_limit = 4.75;
    EXPECT_EQ(refusal([&] { (void)detail::chosen_guards(options, *device); }),
              "force_limit is 4.75: must be at most 4, the force limit of the device");
    options.force_limit = 1.0;
    options.ramp_s = -1.0;
    EXPECT_EQ(refusal([&] { (void)detail::chosen_guards(options, *device); }),
              "ramp_s is -1, must be 0 to 3600");
}

TEST(ApplyCertificate, SetsTheLimitsOfTheProofs) {
    const PlannedModel model = proved_model();
    const Certificate& certificate = *model.certificate;
    for (const double share : {0.8, 1.0}) {
        GuardSettings guards;
        guards.force_limit = 1.0;
        LoopSettings loop;
        loop.lowest_rate_share = share;
        detail::apply_certificate(certificate, guards, loop);
        EXPECT_TRUE(guards.certified);
        EXPECT_EQ(guards.slew_s, 0.0);
        EXPECT_EQ(guards.force_limit, 5.0);
        EXPECT_EQ(guards.device_damping, 0.06);
        EXPECT_EQ(guards.device_friction, 0.01);
        EXPECT_EQ(guards.longest_delay_s, certificate.device.delay_s);
        EXPECT_EQ(loop.tolerated, 0U);
        EXPECT_EQ(loop.lowest_rate_share, share == 1.0 ? 1.0 : 0.99);
        EXPECT_EQ(loop.longest_period_s, certificate.longest_period_s);
    }
}

// ------------------------------------------------------------------------------------------- preparation

/// Returns the texts of one key of the metadata.
std::vector<std::string> texts(const RenderJob& job, const std::string& key) {
    std::vector<std::string> found;
    for (const auto& [name, text] : job.metadata) {
        if (name == key) {
            found.push_back(text);
        }
    }
    return found;
}

TEST(PrepareRendering, StatesWhyARealDeviceMayNotMove) {
    PlannedModel model = proved_model();
    model.name = "a.json";
    const DeviceProfile profile = model.certificate->device;
    model.certificate.reset();
    EXPECT_EQ(
        refusal([&] { (void)prepared(model, profile, false, {}); }),
        "a.json has no certificate; make a certificate with 'palpate plan', or set uncertified to render "
        "without a certificate");
}

TEST(PrepareRendering, UsesThePlanUnlessAStructureIsChosen) {
    PlannedModel model = proved_model();
    model.limited = model.model;
    RenderJob job = prepared(model, true, {});
    EXPECT_EQ(&job.model, &*model.limited);
    EXPECT_EQ(job.scheme.structure, StructureKind::Massless);
    EXPECT_EQ(job.scheme.coupling.stiffness, 60.0);
    EXPECT_EQ(job.session.loop.rate_hz, 1000.0);
    EXPECT_EQ(job.session.loop.longest_period_s, model.certificate->longest_period_s);
    EXPECT_EQ(texts(job, "certified"), std::vector<std::string>{"certified"});
    EXPECT_EQ(texts(job, "rate_hz"), std::vector<std::string>{"1000"});
    EXPECT_EQ(texts(job, "model"), std::vector<std::string>{model.name});
    EXPECT_EQ(texts(prepared(model, false, {}), "certified"), std::vector<std::string>{"yes"});

    RenderOptions options;
    options.scheme.coupling_stiffness = 500.0;
    const RenderJob own = prepared(model, true, options);
    EXPECT_EQ(&own.model, &model.model);
    EXPECT_EQ(own.scheme.coupling.stiffness, 500.0);
    EXPECT_EQ(own.notes, std::vector<std::string>{"uncertified: the options change the plan"});
    EXPECT_EQ(texts(own, "certified"), std::vector<std::string>{"no: the options change the plan"});
    EXPECT_EQ(own.session.loop.tolerated, LoopSettings{}.tolerated);
    options.tolerated = 9;
    EXPECT_EQ(prepared(model, true, options).session.loop.tolerated, 9U);
}

TEST(PrepareRendering, NotesTheDefaultCouplingOfAModelWithoutAPlan) {
    const std::string note =
        "the model has no plan: rendered behind the default coupling, which makes the object softer; "
        "'palpate "
        "plan' chooses a structure";
    PlannedModel model = proved_model();
    const DeviceProfile profile = model.certificate->device;
    model.certificate.reset();
    EXPECT_TRUE(prepared(model, profile, true, {}).notes.empty());
    model.plan.reset();
    EXPECT_EQ(prepared(model, profile, true, {}).notes, std::vector<std::string>{note});
    RenderOptions options;
    options.scheme.structure = StructureKind::Massless;
    EXPECT_TRUE(prepared(model, profile, true, options).notes.empty());

    PlannedModel direct = stored("certificate_velocity.json");
    ASSERT_EQ(direct.plan->structure, StructureKind::Direct);
    const DeviceProfile its = direct.certificate->device;
    direct.certificate.reset();
    direct.plan.reset();
    EXPECT_TRUE(prepared(direct, its, true, {}).notes.empty()) << "it is rendered without a coupling";
}

// A simulated device with a note that the certificate is not used, a real one without.
TEST(PrepareRendering, NotesAnUnusedCertificateOnlyOfASimulatedDevice) {
    RenderOptions options;
    options.uncertified = true;
    const std::vector<std::string> note{"uncertified: uncertified was set"};
    EXPECT_EQ(prepared(proved_model(), true, options).notes, note);
    const RenderJob real = prepared(proved_model(), false, options);
    EXPECT_TRUE(real.notes.empty());
    EXPECT_EQ(texts(real, "certified"), std::vector<std::string>{"no: uncertified was set"});
}

TEST(PrepareRendering, WatchesADeviceThatRendersTheModelItself) {
    PlannedModel model = proved_model();
    model.certificate->device.renderer = "device";
    const auto device = device_at(0.0, model.certificate->device);
    RecordSinks sinks;
    const RenderJob job = prepare_rendering({}, model, *device, sinks);
    EXPECT_EQ(sinks.force, RecordedForce::Applied);
    EXPECT_EQ(job.notes,
              std::vector<std::string>{
                  "the device renders the model; the host watches and records the force of its motor"});
    EXPECT_EQ(texts(job, "force"),
              std::vector<std::string>{"of the motor, from the model that the device renders"});
    EXPECT_EQ(texts(job, "certified"), std::vector<std::string>{"yes"});
    EXPECT_FALSE(job.guards.certified) << "the host sends no force that a proof limits";
    EXPECT_EQ(job.session.loop.tolerated, LoopSettings{}.tolerated);

    RecordSinks of_host;
    model.certificate->device.renderer.reset();
    const RenderJob host = prepare_rendering({}, model, *device, of_host);
    EXPECT_EQ(of_host.force, RecordedForce::Sent);
    EXPECT_TRUE(texts(host, "force").empty());
}

// The scheme is stable at the period of its renderer only: an explicit object of this mass diverges at 1 kHz.
TEST(PrepareRendering, ChecksTheSchemeAtThePeriodOfItsRenderer) {
    PlannedModel model = proved_model();
    model.plan->structure = StructureKind::Explicit;
    model.plan->compensated = false;
    model.plan->inertia = {1e-5, 0.0};
    model.certificate->device.renderer = "device";
    const auto device = device_at(0.0, model.certificate->device);
    RecordSinks sinks;
    const auto refused = [&](double period_s) {
        model.certificate->device.period_s = period_s;
        return refusal([&] { (void)prepare_rendering({}, model, *device, sinks); });
    };
    EXPECT_NE(refused(1e-3).find("structure is explicit, which diverges"), std::string::npos);
    EXPECT_EQ(refused(1e-5), "");
    model.certificate->device.renderer.reset();
    EXPECT_NE(refused(1e-3).find("structure is explicit, which diverges"), std::string::npos);
    model.certificate.reset();
    device->simulated = true;
    model.plan->inertia = {1e-4, 0.0};
    int accepted = 0;
    for (double rate_hz = 100.0; rate_hz <= 10'000.0; rate_hz *= 1.5) {
        device->rate_hz = rate_hz;
        const std::string reason = refusal([&] { validate(*model.plan, model.model, 1.0 / rate_hz); });
        EXPECT_EQ(refusal([&] { (void)prepare_rendering({}, model, *device, sinks); }), reason);
        accepted += reason.empty() ? 1 : 0;
    }
    EXPECT_TRUE(accepted > 0 && accepted < 12) << accepted;
}

TEST(PrepareRendering, ChecksTheSettingsThatItHasChosen) {
    PlannedModel model = proved_model();
    const auto refused = [&] { return refusal([&] { (void)prepared(model, true, {}); }); };
    EXPECT_EQ(refused(), "");
    model.certificate->longest_period_s = 0.0005;
    EXPECT_EQ(refused(), "longest_period_s is 0.0005, must be at least one period");
    model.certificate->longest_period_s = 0.002;
    const DeviceProfile profile = model.certificate->device;
    model.certificate->device.coulomb_friction = -1.0;
    EXPECT_EQ(refusal([&] { (void)prepared(model, profile, true, {}); }),
              "device_friction is -1, must be >= 0");
}

class RecordedRendering : public testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = testing::TempDir() + "render-XXXXXX";
        ASSERT_NE(mkdtemp(pattern.data()), nullptr);
        folder_ = pattern;
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    [[nodiscard]] std::string file(const std::string& name) const { return folder_ / name; }
    [[nodiscard]] std::string text(const std::string& name) const {
        std::ifstream stream{file(name)};
        return {std::istreambuf_iterator<char>{stream}, {}};
    }

  private:
    std::filesystem::path folder_;
};

TEST_F(RecordedRendering, DoesNotReplaceTheModelFile) {
    PlannedModel model = proved_model();
    model.name = file("a.json");
    std::ofstream{model.name} << "{}";
    RenderOptions options;
    options.force = true;
    options.record = file("./a.json");
    EXPECT_EQ(refusal([&] { (void)prepared(model, true, options); }),
              "record is " + options.record + ", the model file: choose another name");
    EXPECT_EQ(text("a.json"), "{}");
    options.record = file("b.csv");
    EXPECT_TRUE(prepared(model, true, options).notes.empty());
}

TEST_F(RecordedRendering, KeepsAnInterruptedRecordingAndNotesItsName) {
    std::ofstream{file("a.csv.part")} << "interrupted\n";
    RenderOptions options;
    options.record = file("a.csv");
    const RenderJob job = prepared(proved_model(), true, options);
    EXPECT_EQ(job.notes, std::vector<std::string>{"an earlier recording that was interrupted is kept as " +
                                                  file("a.csv.1.part")});
}

TEST_F(RecordedRendering, OpensRecordingAndTelemetryOnlyOnRequest) {
    RecordSinks none;
    EXPECT_EQ(detail::open_sinks({}, {}, {}, none), "");
    EXPECT_FALSE(none.file.is_open());
    none.telemetry.take(std::vector<TickRecord>(1));
    EXPECT_EQ(none.telemetry.sent() + none.telemetry.dropped(), 0U);

    RunOptions options;
    options.telemetry_port = 9;
    options.telemetry_hz = 10.0;
    RecordSinks sending;
    EXPECT_EQ(detail::open_sinks(options, {}, {}, sending), "");
    EXPECT_FALSE(sending.file.is_open());
    std::vector<TickRecord> ticks(3);
    ticks[1].time = 0.05;
    ticks[2].time = 0.1;
    sending.telemetry.take(ticks);
    EXPECT_EQ(sending.telemetry.sent() + sending.telemetry.dropped(), 2U);

    options.record = file("a.csv");
    std::ofstream{options.record} << "old\n";
    RecordSinks taken;
    EXPECT_EQ(refusal([&] { (void)detail::open_sinks(options, {}, {}, taken); }),
              options.record + " exists already; choose another name, or replace it with --force");
    options.force = true;
    RecordSinks replacing;
    EXPECT_EQ(detail::open_sinks(options, {}, {{"key", "text"}}, replacing), "");
    EXPECT_NE(text("a.csv.part").find("# key: text\n"), std::string::npos);
}

TEST_F(RecordedRendering, RefusesTelemetryWithoutASocket) {
    rlimit before{};
    ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
    rlimit none = before;
    none.rlim_cur = 0;
    RunOptions options;
    options.telemetry_port = 9;
    RecordSinks sinks;
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
    const std::string reason = refusal([&] { (void)detail::open_sinks(options, {}, {}, sinks); });
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
    EXPECT_EQ(reason, "no telemetry: Too many open files");
}

// ------------------------------------------------------------------------------------------------ summary

TEST_F(RecordedRendering, EndsInASummaryOfAllItsParts) {
    const auto device = device_at(0.0, {});
    for (const bool fault : {false, true}) {
        RunOptions options;
        options.record = file(fault ? "fault.csv" : "good.csv");
        options.telemetry_port = 9;
        RecordSinks sinks;
        sinks.keeps = true;
        ASSERT_EQ(detail::open_sinks(options, {}, {}, sinks), "");
        std::vector<TickRecord> ticks(3);
        ticks[2].position = 1.0;
        ticks[2].force = 2.0;
        sinks.take(ticks);
        SessionReport report;
        report.loop.ticks_by_status[static_cast<std::size_t>(Status::Ok)] = 3;
        report.loop.exit_reason = fault ? ExitReason::Guard : ExitReason::TimeUp;
        report.lost_records = 4;
        report.last_ticks = ticks;
        const Summary summary = detail::finish(options, {.rate_hz = 500.0}, {"rad", "Nm"}, {}, sinks, report,
                                               {.encoder_step = 0.125, .position_unit = "rad"}, *device);
        EXPECT_EQ(summary.loop.rate_hz, 500.0);
        EXPECT_EQ(summary.units.force, "Nm");
        EXPECT_EQ(summary.record, options.record);
        EXPECT_EQ(summary.recorded, 3U);
        EXPECT_EQ(summary.lost_records, 4U);
        EXPECT_EQ(summary.telemetry_sent + summary.telemetry_dropped, 1U);
        EXPECT_EQ(summary.positions.upper, 1.0);
        EXPECT_EQ(summary.forces.upper, 2.0);
        EXPECT_EQ(summary.kept.size(), 3U);
        EXPECT_EQ(summary.device, "a moved device");
        EXPECT_EQ(summary.device_report.name, "moved");
        EXPECT_EQ(summary.last_ticks,
                  fault ? "the last 3 ticks are in " + file("fault.fault.csv") : std::string{});
        EXPECT_EQ(level_of(summary.findings), fault ? "no" : "usable") << "the report has lost records";
        EXPECT_TRUE(summary.warnings.empty());
        EXPECT_NE(text(fault ? "fault.csv" : "good.csv").find("; lost records 4"), std::string::npos);
    }
}

TEST_F(RecordedRendering, CountsRowsThatTheDiskRefused) {
    rlimit before{};
    ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
    const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
    const auto device = device_at(0.0, {});
    RunOptions options;
    options.record = file("a.csv");
    RecordSinks sinks;
    ASSERT_EQ(detail::open_sinks(options, {}, {}, sinks), "");
    rlimit small = before;
    small.rlim_cur = 8192;
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    sinks.take(std::vector<TickRecord>(1000));
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
    std::signal(SIGXFSZ, old_handler);
    SessionReport report;
    report.lost_records = 4;
    const Summary summary = detail::finish(options, {}, {}, {}, sinks, report, {}, *device);
    EXPECT_LT(summary.recorded, 1000U);
    EXPECT_EQ(summary.recorded + summary.lost_records, 1004U);
    ASSERT_EQ(summary.warnings.size(), 1U);
    EXPECT_NE(verdict_text(summary.findings).find(summary.warnings.front()), std::string::npos);
}

TEST_F(RecordedRendering, IsJudgedByItsRows) {
    const auto device = device_at(0.0, {});
    RunOptions options;
    options.record = file("a.csv");
    RecordSinks sinks;
    ASSERT_EQ(detail::open_sinks(options, {}, {}, sinks), "");
    const Summary summary = detail::finish(options, {}, {}, {}, sinks, {}, {}, *device);
    EXPECT_EQ(verdict_text(summary.findings).rfind("no: nothing was recorded", 0), 0U);
}

TEST(Finish, NeedsNoRecording) {
    const auto device = device_at(0.0, {});
    RecordSinks sinks;
    sinks.take(std::vector<TickRecord>(2));
    SessionReport report;
    report.loop.exit_reason = ExitReason::Guard;
    const Summary summary = detail::finish({}, {}, {}, {}, sinks, report, {}, *device);
    EXPECT_EQ(verdict_text(summary.findings).find("recorded"), std::string::npos);
    EXPECT_EQ(summary.record, "");
    EXPECT_EQ(summary.last_ticks, "");
    EXPECT_TRUE(summary.warnings.empty());
}

// ---------------------------------------------------------------------------------------------- rendering

struct Rendering {
    PlannedModel model = proved_model();
    RenderOptions options{};
    RecordSinks sinks{};

    Rendering() {
        options.uncertified = true;
        options.ramp_s = 0.1;
        options.frozen_s = 0.0;
        options.loop.duration_s = 0.5;
        options.loop.lowest_rate_share = 0.0;
        options.real_time = {.priority = 0, .cpu = -2};
        sinks.keeps = true;
    }
    Summary run(LiveDevice& device) {
        const std::atomic<bool> stop_requested{false};
        const RenderJob job = prepare_rendering(options, model, device, sinks);
        return render(options, model, job, device, sinks, stop_requested, [](const SessionView&) {});
    }
};

// At rest the coupling does not change the force of a compensated model.
TEST(Render, SendsTheForceOfTheModelAfterTheRamp) {
    Rendering rendering;
    const auto device = device_at(0.4, rendering.model.certificate->device);
    const Summary summary = rendering.run(*device);
    ASSERT_EQ(summary.kept.size(), 500U);
    EXPECT_EQ(summary.report.loop.ticks_by_status[static_cast<std::size_t>(Status::Ramp)], 100U);
    const double force = rendering.model.model.network()->at(0.4, {}).force;
    ASSERT_GT(force, 0.1);
    EXPECT_NEAR(summary.kept.back().force, force, 1e-9 * force);
    EXPECT_NEAR(summary.kept[50].force, 0.5 * force, 1e-9 * force);
    EXPECT_EQ(
        verdict_text(summary.findings),
        "usable: the handle covered 0 rad, so the force over position is unknown: move the handle over the "
        "whole object");
    EXPECT_EQ(summary.notes, std::vector<std::string>{});
    EXPECT_EQ(summary.units.force, "Nm");
}

TEST(Render, JudgesPositionsByTheDomainOfTheModel) {
    Rendering rendering;
    rendering.options.scheme.structure = StructureKind::Direct;
    NetworkParameters network;
    network.linear = {2.0};
    rendering.model.model = {network,
                             {{0.25}, {0.5}, Continuation::Linear, Continuation::Linear, std::nullopt}};
    const auto device = test::moved_device(
        {[](std::uint64_t sample) { return 0.61 + 1e-5 * static_cast<double>(sample % 100); }},
        rendering.model.certificate->device);
    const std::string verdict = verdict_text(rendering.run(*device).findings);
    EXPECT_NE(
        verdict.find("500 of 500 (100 %) ticks had a position outside the model's domain, 0.25 to 0.5 rad"),
        std::string::npos)
        << verdict;
    EXPECT_NE(verdict.find("the handle covered 0.00099 rad, 0.396 % of the model's domain"),
              std::string::npos)
        << verdict;
}

TEST(Render, OnlyWatchesADeviceThatRenders) {
    Rendering rendering;
    rendering.options.uncertified = false;
    rendering.model.certificate->device.renderer = "device";
    const auto device =
        test::moved_device({[](std::uint64_t sample) { return sample < 250 ? 0.1 : 0.7; }, 0.75},
                           rendering.model.certificate->device);
    rendering.options.largest_speed = 601.0;
    const Summary summary = rendering.run(*device);
    ASSERT_EQ(summary.kept.size(), 500U);
    EXPECT_EQ(summary.forces.lower, 0.75);
    EXPECT_EQ(summary.forces.upper, 0.75);
    EXPECT_EQ(summary.report.loop.ticks_by_status[static_cast<std::size_t>(Status::Ramp)], 100U);
    EXPECT_EQ(summary.notes.size(), 1U);
    EXPECT_FALSE(summary.kept[249].extrapolated);
    EXPECT_TRUE(summary.kept[250].extrapolated);
    EXPECT_TRUE(std::isinf(summary.report.loop.most_stored)) << "the host has no energy account";

    rendering.options.largest_speed = 599.0;
    rendering.sinks.kept.clear();
    device->device().sequence = 0;
    const Summary jump = rendering.run(*device);
    EXPECT_EQ(jump.report.loop.status, Status::Jump);
    EXPECT_EQ(jump.kept.size(), 251U);
}

}  // namespace
}  // namespace palpate
