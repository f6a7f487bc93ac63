// SPDX-License-Identifier: Apache-2.0
#include "palpate/run/render.hpp"

#include <algorithm>
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

/// Prepares a rendering of a stored model on the device of its certificate.
RenderJob prepared(const PlannedModel& model, bool simulated, const RenderOptions& options) {
    const DeviceProfile& profile = model.certificate->device;
    LiveDeviceOf<SimulatedDevice> device{SimulatedDevice{profile, Hand{}}};
    device.profile = profile;
    device.scale = scale_of(model.model, true);
    device.rate_hz = 1.0 / profile.period_s;
    device.simulated = simulated;
    RecordSinks sinks;
    return prepare_rendering(options, model, device, sinks);
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

TEST(PrepareRendering, MovesARealDeviceWithAStablePlanOnlyIfUncertifiedIsSet) {
    const PlannedModel model = stored("certificate_stable.json");
    EXPECT_THROW((void)prepared(model, false, {}), std::invalid_argument);
    RenderOptions options;
    options.uncertified = true;
    const RenderJob job = prepared(model, false, options);
    EXPECT_FALSE(job.guards.certified);
    EXPECT_EQ(certified(job), "no: uncertified was set");
}

}  // namespace
}  // namespace palpate
