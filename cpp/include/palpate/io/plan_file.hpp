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
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/stability/certificate_check.hpp"

// The two parts of a model file that say how it is rendered: the plan, and what is proved of it.
namespace palpate::detail {

template <class Enum, std::size_t n>
[[nodiscard]] Enum read_name(const JsonField& field, const std::array<std::string_view, n>& names) {
    std::string right;
    for (std::size_t k = 0; k < n; ++k) {
        if (field.value().is_string() && field.value().get<std::string>() == names[k]) {
            return static_cast<Enum>(k);
        }
        right += (k == 0 ? "one of '" : ", '") + std::string(names[k]) + "'";
    }
    field.refuse(right);
}

/// Given where the structure has a use for it, null where it has none.
inline void require_given(const JsonField& field, bool used, const char* structure_has) {
    field.require(field.is_null() != used, (used ? "given: " : "null: ") + std::string("the structure has ") +
                                               (used ? "" : "no ") + structure_has);
}

[[nodiscard]] inline std::optional<Scheme> read_plan(const JsonField& plan) {
    if (plan.is_null()) {
        return std::nullopt;
    }
    plan.only({"structure", "solver", "network", "coupling", "inertia", "compensated", "play_radius",
               "predict", "refused", "accepted_force_error"});
    Scheme scheme;
    scheme.structure = read_name<StructureKind>(plan["structure"], structure_names);
    if (const JsonField solver = plan["solver"]; !solver.is_null()) {
        (void)solver.words();
    }
    const JsonField coupling = plan["coupling"];
    if (!coupling.is_null()) {
        coupling.only({"stiffness", "damping"});
        scheme.coupling = {coupling["stiffness"].positive(), coupling["damping"].not_negative()};
    }
    require_given(coupling, scheme.structure != StructureKind::Direct, "coupling");
    const JsonField inertia = plan["inertia"];
    if (!inertia.is_null()) {
        inertia.only({"mass", "damping"});
        scheme.inertia = {inertia["mass"].positive(), inertia["damping"].not_negative()};
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
    for (const JsonField& sentence : plan["refused"].items()) {
        (void)sentence.words();
    }
    (void)plan["accepted_force_error"].not_negative();
    return scheme;
}

[[nodiscard]] inline DeviceProfile read_device(const JsonField& device) {
    device.only({"id", "position_unit", "period_s", "jitter_s", "inertia", "viscous_damping",
                 "coulomb_friction", "encoder_step", "force_step", "delay_s", "force_limit"});
    DeviceProfile profile;
    profile.id = device["id"].words();
    profile.position_unit = device["position_unit"].one_of({"rad", "m"});
    profile.period_s = device["period_s"].positive();
    profile.jitter_s = device["jitter_s"].not_negative();
    profile.inertia = device["inertia"].positive();
    profile.viscous_damping = device["viscous_damping"].not_negative();
    profile.coulomb_friction = device["coulomb_friction"].not_negative();
    profile.encoder_step = device["encoder_step"].not_negative();
    profile.force_step = device["force_step"].not_negative();
    profile.delay_s = device["delay_s"].not_negative();
    device["delay_s"].require(profile.delay_s <= longest_delay_s(profile.period_s),
                              "at most " + readable(longest_delay_s(profile.period_s)));
    profile.force_limit = device["force_limit"].positive();
    return profile;
}

[[nodiscard]] inline ForceBounds read_bounds(const JsonField& bounds, bool hysteresis) {
    bounds.only({"slope_min", "slope_max", "steepest", "sliding", "loss_min", "loss_max", "loss_per_play",
                 "mean_force", "drag"});
    ForceBounds read;
    read.hysteresis = hysteresis;
    read.slope = {bounds["slope_min"].number(), bounds["slope_max"].number()};
    read.steepest = bounds["steepest"].number();
    read.sliding = bounds["sliding"].number();
    read.loss = {bounds["loss_min"].number(), bounds["loss_max"].number()};
    read.loss_per_play = bounds["loss_per_play"].number();
    read.mean_force = bounds["mean_force"].number();
    read.drag = bounds.value().contains("drag") ? bounds["drag"].not_negative() : 0.0;
    return read;
}

[[nodiscard]] inline Inequality read_inequality(const JsonField& line) {
    line.only({"id", "left", "right"});
    Inequality read;
    read.id = line["id"].words();
    read.left = line["left"].number();
    read.right = line["right"].number();
    return read;
}

/// The certificate of a plan, recomputed from the rendered model and the device: one that says anything else is
/// refused.
[[nodiscard]] inline std::optional<Certificate> read_certificate(const JsonField& file,
                                                                 const std::optional<Scheme>& plan,
                                                                 const ForceModel& model,
                                                                 const std::string& position_unit) {
    if (file.is_null()) {
        return std::nullopt;
    }
    file.only({"fingerprint", "model", "structure", "device", "bounds", "inequalities", "verdict",
               "longest_period_s"});
    file.require(plan.has_value(), "null, because plan is");
    Certificate read;
    read.scheme = *plan;
    read.fingerprint = file["fingerprint"].words();
    read.model = file["model"].words();
    file["structure"].require(read_name<StructureKind>(file["structure"], structure_names) == plan->structure,
                              "that of the plan");
    read.device = read_device(file["device"]);
    file["device"]["position_unit"].require(
        position_unit.empty() || position_unit == read.device.position_unit,
        "the unit of the model's position");
    read.bounds = read_bounds(file["bounds"], model.hysteresis() != nullptr);
    for (const JsonField& line : file["inequalities"].items()) {
        read.inequalities.push_back(read_inequality(line));
    }
    read.verdict = read_name<Verdict>(file["verdict"], verdict_names);
    read.longest_period_s = file["longest_period_s"].not_negative();
    return checked(read, model);
}

}  // namespace palpate::detail
