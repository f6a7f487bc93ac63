// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "palpate/device/inverse3.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/fields/value.hpp"
#include "palpate/run/live_device.hpp"
#include "palpate/run/open_inverse3.hpp"
#include "palpate/run/render.hpp"

// Definition of open_inverse3. nlohmann-json takes long to compile.
namespace palpate {

PALPATE_INLINE std::unique_ptr<LiveDevice> open_inverse3(const RenderOptions& options,
                                                         const PlannedModel& model) {
    constexpr double usual_force_limit = 2.0;  // [N]; used because the service reports no force limit
    if (model.position_unit != "m" || model.force_unit != "N") {
        refuse(model.units_text() + "; an Inverse3 moves along a line and needs a model in m and N");
    }
    Inverse3Settings settings = inverse3_settings(options.device.substr(std::string("inverse3").size()));
    if (options.wait_s) {
        settings.answer_timeout = std::chrono::milliseconds{std::llround(std::ceil(1e3 * *options.wait_s))};
    }
    auto live = std::make_unique<LiveDeviceOf<Inverse3Device>>(
        Inverse3Device{std::move(settings)}, [](const Inverse3Device& device) -> DeviceReport {
            const Inverse3Info& info = device.info();
            const auto value = [](std::optional<double> number) { return number ? Value{*number} : Value{}; };
            return {"inverse3",
                    {{"force_gate", value(info.force_gate)},
                     {"damping", value(info.damping)},
                     {"skipped_states", device.skipped_states()}},
                    {{"service",
                      "force gate " + readable(info.force_gate) + ", damping " + readable(info.damping)},
                     {"skipped", std::to_string(device.skipped_states()) +
                                     " states that the service sent without a command"}}};
        });
    if (const Opened opened = live->open(); !opened) {
        refuse("device " + options.device + ": " + opened.reason);
    }
    const Inverse3Info& info = live->device().info();
    const std::string filters = live->report().lines.front().second;
    // A certificate holds for the force that is sent; the service changes it by these filters
    const bool certified = !options.uncertified && model.certificate;
    if (certified && (info.force_gate != 0.0 || info.damping != 0.0)) {
        refuse(
            "device " + options.device + ": the Inverse Service reports " + filters +
            " after this program set both to 0, but a certificate holds without its filters: install version "
            "3.5 or newer of the service and close programs that set its filters, or set uncertified");
    }
    const double period_s = 1.0 / options.loop.rate_hz;
    live->scale = scale_of(model.model, false);
    // The service does not send inertia, damping and friction of the device. The profile of the certificate is used;
    // without a certificate, or with `uncertified`, damping and friction are 0.
    if (certified) {
        live->profile = model.certificate->device;
    } else {
        live->profile = unmeasured(scaled_knob(live->scale, false, period_s));
        live->profile.force_limit = options.force_limit.value_or(usual_force_limit);
    }
    live->profile.id = info.name();
    live->profile.period_s = period_s;
    live->profile.position_unit = "m";
    live->title =
        live->profile.id + " (the service's " + filters + ")" + (options.uncertified ? ", uncertified," : "");
    live->rate_hz = options.loop.rate_hz;
    live->metadata = {{"device", live->profile.id + " through the Haply Inverse Service, " + options.device},
                      {"service", filters}};
    return live;
}

}  // namespace palpate
