// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/guard/guard_settings.hpp"
#include "palpate/inline.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/scale.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/run/live_device.hpp"
#include "palpate/run/record_sinks.hpp"
#include "palpate/run/session.hpp"
#include "palpate/run/session_text.hpp"
#include "palpate/run/summary.hpp"
#include "palpate/stability/certificate.hpp"

namespace palpate {

/// Options of every run on a device, for rendering and for measuring.
struct RunOptions {
    std::string device = "simulated";
    std::optional<double> wait_s;  ///< longest wait of a tick for a sample [s]; unset: the device's default
    LoopSettings loop;
    RealTimeOptions real_time;
    std::string record;  ///< name of the recording; empty without one
    bool force = false;  ///< true: replace an existing recording
    std::optional<std::uint16_t> telemetry_port;
    double telemetry_hz = Telemetry::usual_hz;
    std::string created_by;
};

template <>
inline constexpr auto fields_of<RunOptions> =
    FieldTable{Field<&RunOptions::device>{"device"},
               Field<&RunOptions::wait_s>{"wait_s"},
               Field<&RunOptions::loop, &LoopSettings::rate_hz>{"rate_hz"},
               Field<&RunOptions::loop, &LoopSettings::duration_s>{"duration_s"},
               Field<&RunOptions::loop, &LoopSettings::lowest_rate_share>{"lowest_rate_share"},
               Field<&RunOptions::real_time, &RealTimeOptions::priority>{"priority"},
               Field<&RunOptions::real_time, &RealTimeOptions::cpu>{"cpu"},
               Field<&RunOptions::record>{"record"},
               Field<&RunOptions::force>{"force"},
               Field<&RunOptions::telemetry_port>{"telemetry_port"},
               Field<&RunOptions::telemetry_hz>{"telemetry_hz"}};

/// Options of a rendering. Fields that are not set get a default from the model and the device.
struct RenderOptions : RunOptions {
    bool rate_given = false;  ///< true if the user chose loop.rate_hz
    SchemeChoices scheme;
    std::optional<double> force_limit;
    std::optional<double> largest_speed;
    std::optional<double> slew_s;
    std::optional<std::uint64_t> tolerated;
    double ramp_s = GuardSettings{}.ramp_s;
    double frozen_s = GuardSettings{}.frozen_s;
    bool energy_account = true;
    bool uncertified = false;
    bool accept_model = false;        ///< true: a model with the verdict no is rendered
    std::vector<std::string> faults;  ///< faults that the simulated device must produce, for tests
};

template <>
inline constexpr auto fields_of<RenderOptions> =
    fields_of<RunOptions> + all_within<&RenderOptions::scheme>(fields_of<SchemeChoices>) +
    FieldTable{Field<&RenderOptions::force_limit>{"force_limit"},
               Field<&RenderOptions::uncertified>{"uncertified"}, Field<&RenderOptions::faults>{"faults"}};

/// A model with its units, plan and certificate.
struct PlannedModel {
    std::string name;  ///< name of the model file
    ForceModel model;  ///< the identified model
    std::string position_unit;
    std::string force_unit;
    std::optional<Scheme> plan;
    std::optional<ForceModel> limited;  ///< model that the plan renders instead of `model`
    std::optional<Certificate> certificate;
    std::vector<std::string> findings{};   ///< defects that the identification found
    std::optional<std::string> refusal{};  ///< the defect with which the verdict on the model is no

    /// Returns the model that the plan renders.
    [[nodiscard]] const ForceModel& planned() const noexcept { return limited ? *limited : model; }
    /// Returns the name and the units of the model, for a message.
    [[nodiscard]] std::string units_text() const {
        const auto unit = [](const std::string& text) { return text.empty() ? "no unit" : text; };
        return name + " is in " + unit(position_unit) + " and " + unit(force_unit);
    }
    /// Returns the units in the column names of a recording of this model.
    [[nodiscard]] RecordUnits units() const { return record_units(position_unit, force_unit); }
};

/// Model and all settings of a rendering on an open device, complete before the handle moves.
struct RenderJob {
    const ForceModel& model;  ///< the rendered model
    Scheme scheme;
    GuardSettings guards;
    SessionSettings session;
    Metadata metadata;
    std::vector<std::string> notes;  ///< messages for the user
};

/// Throws std::invalid_argument with the given sentence.
[[noreturn]] inline void refuse(std::string_view sentence) {
    throw std::invalid_argument(std::string{sentence});
}

/// Returns true if the options change the rendering that the plan describes. The certificate does not hold in this
/// case.
[[nodiscard]] inline bool changes_plan(const RenderOptions& options) noexcept {
    return options.scheme.any() || options.force_limit || options.slew_s || options.tolerated;
}

/// Returns true if the device renders the plan itself. The host then sends no force; it watches the device and records.
[[nodiscard]] inline bool rendered_by_device(const RenderOptions& options,
                                             const PlannedModel& model) noexcept {
    return !options.uncertified && model.certificate && model.certificate->device.renderer;
}

/// Returns true if a simulated run uses the device and the rate for which the model was planned.
[[nodiscard]] inline bool follows_certificate(const RenderOptions& options,
                                              const PlannedModel& model) noexcept {
    return model.certificate && !options.uncertified && !changes_plan(options);
}

/// Returns true if the plan is for an admittance display. It is rendered as planned only, also without its certificate.
[[nodiscard]] inline bool is_for_display(const PlannedModel& model) noexcept {
    return model.certificate && model.certificate->device.admittance;
}

/// Returns true if the certificate limits the energy that a hand can take out.
[[nodiscard]] inline bool proves_energy(const Certificate& certificate) noexcept {
    return certificate.certified() || certificate.held_by_account();
}

/// Returns the reason why a rendering that is held by the energy account must not run without it; otherwise "".
[[nodiscard]] inline std::string account_reason(const RenderOptions& options,
                                                const Certificate& certificate) {
    return certificate.held_by_account() && !options.energy_account
               ? "it is held by the energy account, which is switched off"
               : "";
}

/// Returns the reason why no proof holds for a run on a simulated device; empty if the certificate of the model holds
/// and its verdict is `Certified` or `HeldByAccount`. A certificate with the verdict `StableLocally` proves nothing about
/// the energy.
[[nodiscard]] inline std::string uncertified_reason(const RenderOptions& options, const PlannedModel& model) {
    if (!model.certificate) {
        return "the model has no certificate";
    }
    if (options.uncertified) {
        return "uncertified was set";
    }
    if (changes_plan(options)) {
        return "the options change the plan";
    }
    const Certificate& certificate = *model.certificate;
    return proves_energy(certificate) ? account_reason(options, certificate)
                                      : "the certificate is " + std::string(name_of(certificate.verdict)) +
                                            ": " + certificate.reason;
}

/// Chooses scheme, guards and rate of a rendering on an open device, then opens recording and telemetry. A real device
/// requires a certificate that holds for this device, unless `uncertified` is set. Throws std::invalid_argument with
/// the reason if the rendering is not allowed.
[[nodiscard]] PALPATE_INLINE RenderJob prepare_rendering(const RenderOptions& options,
                                                         const PlannedModel& model, const LiveDevice& device,
                                                         RecordSinks& sinks);

/// Renders a model on an open device until the control loop ends, then closes the device and returns the summary.
[[nodiscard]] PALPATE_INLINE Summary render(const RenderOptions& options, const PlannedModel& model,
                                            const RenderJob& job, LiveDevice& device, RecordSinks& sinks,
                                            const std::atomic<bool>& stop_requested, const Watch& watch);

}  // namespace palpate

#ifndef PALPATE_COMPILED
#include "palpate/run/detail/render.hpp"
#endif
