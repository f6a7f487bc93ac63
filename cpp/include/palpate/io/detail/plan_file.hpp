// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "palpate/device/device_profile.hpp"
#include "palpate/io/json_field.hpp"
#include "palpate/io/plan_file.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/stability/certificate_check.hpp"

// Definitions of read_plan and read_certificate.
namespace palpate::detail {

/// Throws if the structure needs this JSON field and its value is null, or if the structure does not use the field and
/// its value is not null.
inline void require_given(const JsonField& field, bool used, const char* structure_has) {
    field.require(field.is_null() != used, (used ? "given: " : "null: ") + std::string("the structure has ") +
                                               (used ? "" : "no ") + structure_has);
}

PALPATE_INLINE std::optional<Scheme> read_plan(const JsonField& plan) {
    if (plan.is_null()) {
        return std::nullopt;
    }
    plan.require_keys({"structure", "solver", "network", "coupling", "inertia", "compensated", "play_radius",
                       "predict", "refused", "accepted_force_error", "line"});
    Scheme scheme;
    scheme.structure = plan["structure"].as<StructureKind>();
    if (const JsonField solver = plan["solver"]; !solver.is_null()) {
        (void)solver.string();
    }
    const JsonField coupling = plan["coupling"];
    if (!coupling.is_null()) {
        scheme.coupling = coupling.as<VirtualCoupling>();
    }
    if (coupling.is_null() && has_mass(scheme.structure)) {
        scheme.coupling = {0.0, 0.0};  // plan for an admittance display
    } else {
        require_given(coupling, has_coupling(scheme.structure), "coupling");
    }
    const JsonField inertia = plan["inertia"];
    if (!inertia.is_null()) {
        scheme.inertia = inertia.as<Inertia>();
    }
    require_given(inertia, has_mass(scheme.structure), "inertia");
    scheme.compensated = plan["compensated"].flag();
    if (const JsonField radius = plan["play_radius"]; !radius.is_null()) {
        scheme.play_radius = radius.positive();
    }
    if (const JsonField predict = plan["predict"]; !predict.is_null()) {
        scheme.predict =
            static_cast<int>(std::min<std::uint64_t>(predict.count(1), most_prediction_taps + 1));
        predict.require(scheme.predict <= most_prediction_taps, "<= " + std::to_string(most_prediction_taps));
    }
    if (plan.value().contains("line")) {
        scheme.line = plan["line"].as<HeldSlope>();
    }
    for (const JsonField& sentence : plan["refused"].items()) {
        (void)sentence.string();
    }
    (void)plan["accepted_force_error"].not_negative();
    return scheme;
}

PALPATE_INLINE std::optional<Certificate> read_certificate(const JsonField& file,
                                                           const std::optional<Scheme>& plan,
                                                           const ForceModel& model,
                                                           const std::string& position_unit) {
    if (file.is_null()) {
        return std::nullopt;
    }
    file.require_keys({"fingerprint", "model", "structure", "device", "bounds", "inequalities", "verdict",
                       "longest_period_s"});
    file.require(plan.has_value(), "null, because plan is null");
    Certificate read;
    read.scheme = *plan;
    read.fingerprint = file["fingerprint"].string();
    read.model = file["model"].string();
    file["structure"].require(file["structure"].as<StructureKind>() == plan->structure,
                              "the structure of the plan");
    const JsonField device = file["device"];
    read.device = device.as<DeviceProfile>();
    if (read.device.on_device) {
        throw std::invalid_argument("certificate.device.on_device is not a key of this format");
    }
    const double longest = longest_delay_s(read.device.period_s);
    device["delay_s"].require(read.device.delay_s <= longest, "at most " + readable(longest));
    device["position_unit"].require(position_unit.empty() || position_unit == read.device.position_unit,
                                    "the unit of the model's position");
    read.bounds = file["bounds"].as<ForceBounds>();
    read.bounds.hysteresis = model.hysteresis() != nullptr;
    read.bounds.memory = memory_bounds(model);
    if (holds_line(read.scheme.structure)) {
        read.bounds.bend = bend_bounds(model);
    }
    for (const JsonField& line : file["inequalities"].items()) {
        read.inequalities.push_back(line.as<Inequality>());
    }
    read.verdict = file["verdict"].as<Verdict>();
    read.longest_period_s = file["longest_period_s"].not_negative();
    return checked(read, model);
}

}  // namespace palpate::detail
