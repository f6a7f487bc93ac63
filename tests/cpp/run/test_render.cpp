// SPDX-License-Identifier: Apache-2.0
#include "palpate/run/render.hpp"

#include <algorithm>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "palpate/io/model_file.hpp"
#include "palpate/simulation/simulated_device.hpp"
#include "palpate/simulation/test_rig.hpp"

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

}  // namespace
}  // namespace palpate
