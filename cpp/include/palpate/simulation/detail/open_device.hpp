// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "palpate/fields/readable.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/run/live_device.hpp"
#include "palpate/run/measure.hpp"
#include "palpate/run/open_can.hpp"
#include "palpate/run/open_inverse3.hpp"
#include "palpate/run/open_usb.hpp"
#include "palpate/run/open_wheel.hpp"
#include "palpate/run/render.hpp"
#include "palpate/run/transports.hpp"
#include "palpate/simulation/faulty_device.hpp"
#include "palpate/simulation/open_device.hpp"
#include "palpate/simulation/simulated_device.hpp"
#include "palpate/simulation/simulated_display.hpp"
#include "palpate/simulation/test_rig.hpp"

// Definitions of the functions that open every kind of device. The libraries of the devices take long to compile.
namespace palpate {

/// Opens the simulated device for rendering. Its profile is that of the model's certificate if the run follows the
/// plan, otherwise the default knob, scaled to the model.
[[nodiscard]] inline std::unique_ptr<LiveDevice> open_simulated(const RenderOptions& options,
                                                                const PlannedModel& model) {
    const bool planned = is_for_display(model) || follows_certificate(options, model);
    const double rate_hz = planned ? 1.0 / model.certificate->device.period_s : options.loop.rate_hz;
    if (options.rate_given && std::abs(options.loop.rate_hz - rate_hz) > 1e-6 * rate_hz) {
        refuse("rate_hz is " + readable(options.loop.rate_hz) + ", but the certificate is for " +
               readable(rate_hz) +
               " Hz: make a plan for a device with the period 1 / rate_hz, or set uncertified");
    }
    LoopSettings loop = options.loop;
    loop.rate_hz = rate_hz;
    validate(loop);
    const double period_s = 1.0 / rate_hz;
    TestRig rig = rig_for(model.model, model.position_unit == "rad", period_s);
    if (planned) {
        rig.device = model.certificate->device;
    }
    const double largest_speed =
        options.largest_speed.value_or(guards_for(rig.scale, rig.device).largest_speed);
    std::vector<Fault> faults;
    faults.reserve(options.faults.size());
    for (const std::string& fault : options.faults) {
        faults.push_back(parse_fault(fault, period_s));
    }
    const double jump = 3.0 * largest_speed * period_s;
    std::unique_ptr<LiveDevice> live;
    if (rig.device.admittance) {
        rig.hand = pedal_hand(model.planned(), rig.device, rig.hand);
        const Domain& domain = model.model.domain();
        const double start = domain.lower[0] + 0.01 * (domain.upper[0] - domain.lower[0]);
        live = std::make_unique<LiveDeviceOf<Faulty<SimulatedPedal<Hand>>>>(
            Faulty{SimulatedPedal{rig.device, rig.hand, start}, faults, jump});
    } else {
        live = std::make_unique<LiveDeviceOf<Faulty<SimulatedDevice>>>(
            Faulty{SimulatedDevice{rig.device, rig.hand, simulated_substeps(period_s)}, faults, jump});
    }
    if (const Opened opened = live->open(); !opened) {
        refuse(opened.reason);
    }
    live->title = rig.device.id + " (simulated: no device moves)";
    live->profile = rig.device;
    live->scale = rig.scale;
    live->rate_hz = rate_hz;
    live->metadata = simulated_metadata(rig);
    live->simulated = true;
    return live;
}

namespace detail {

/// Functions of a transport, in the order of `transports`.
struct TransportFunctions {
    std::unique_ptr<LiveDevice> (*open)(const RenderOptions& options, const PlannedModel& model);
    std::unique_ptr<LiveDevice> (*measure)(MeasureOptions& options);  ///< null: cannot measure
};

inline constexpr std::array<TransportFunctions, transports.size()> transport_functions{{
    {open_simulated, nullptr},  // the simulated device is measured with an object
    {open_usb, usb_to_measure},
    {open_can<MitProtocol>, can_to_measure<MitProtocol>},
    {open_can<MoteusProtocol>, can_to_measure<MoteusProtocol>},
    {open_wheel, wheel_to_measure},
    {open_inverse3, nullptr},
}};

/// Returns the index of the transport of a device's name; refuses a name of another form.
[[nodiscard]] inline std::size_t transport_of(const std::string& device, bool measuring) {
    const std::string kind = device.substr(0, device.find(':'));
    for (std::size_t k = 0; k < transports.size(); ++k) {
        const Transport& transport = transports[k];
        const bool has_parts = device.size() > kind.size();
        const bool fits = !has_parts || (transport.form != transport.name && device.size() > kind.size() + 1);
        if (kind == transport.name && fits && (transport.measures || !measuring)) {
            return k;
        }
    }
    refuse("device is '" + device + "', must be " + transport_forms(measuring));
}

}  // namespace detail

PALPATE_INLINE std::unique_ptr<LiveDevice> open_device(const RenderOptions& options,
                                                       const PlannedModel& model) {
    const std::size_t transport = detail::transport_of(options.device, false);
    const std::string_view kind = transports[transport].name;
    if (kind != "simulated" && !options.faults.empty()) {
        refuse(
            "faults is set: must be empty for a real device, because only the simulated device simulates "
            "faults");
    }
    if (kind != "usb" && rendered_by_device(options, model)) {
        const DeviceProfile& certified = model.certificate->device;
        refuse(
            model.name + " is planned for the motor controller of " + certified.id + " at " +
            readable(1.0 / certified.period_s) +
            " Hz: set device to a USB device that contains the exported model, or make a plan for the host "
            "with 'palpate plan' without on_device");
    }
    if (is_for_display(model)) {
        const std::string planned =
            model.name + " is planned for the admittance display " + model.certificate->device.id;
        if (kind != "simulated" && kind != "mit" && kind != "moteus") {
            refuse(
                planned + ", but a device '" + options.device +
                "' applies forces: set device to simulated, mit or moteus, or make a plan for this device");
        }
        if (changes_plan(options)) {
            refuse(planned + ": render it with its plan, without options that change it");
        }
    }
    if (model.force_unit == "A") {
        refuse("the model's force is a motor current in A: identify it with --torque-constant-Nm-per-A");
    }
    return detail::transport_functions[transport].open(options, model);
}

PALPATE_INLINE std::unique_ptr<LiveDevice> device_to_measure(MeasureOptions& options,
                                                             const std::optional<ForceModel>& object) {
    const std::size_t transport = detail::transport_of(options.device, true);
    if (const auto measured = detail::transport_functions[transport].measure; measured != nullptr) {
        return measured(options);
    }
    detail::require(!options.device_renders, "device_renders needs a USB device that contains a model");
    detail::require(object || options.record.empty(),
                    "the simulated device has no object: set object to a model file");
    validate(options.loop);
    const double period_s = 1.0 / options.loop.rate_hz;
    TestRig rig;
    rig.device.period_s = period_s;
    if (object) {
        rig = rig_for(*object, options.units.position == "rad", period_s);
        options.lower = options.lower.value_or(object->domain().lower[0]);
        options.upper = options.upper.value_or(object->domain().upper[0]);
    }
    if (options.moves()) {
        rig.hand.stiffness = rig.hand.damping = 0.0;  // the device moves the handle, so no hand holds it
    }
    rig.device.coulomb_friction = options.friction_share * rig.device.force_limit;
    validate(rig.device);
    SimulatedRig device{rig.device, rig.hand, simulated_substeps(period_s)};
    const bool transducer = object && options.transducer;
    if (object) {
        device.mount({object_of(*object, rig, 0.0), transducer});
    }
    auto live = std::make_unique<LiveDeviceOf<SimulatedRig>>(std::move(device));
    live->title = rig.device.id;
    live->profile = rig.device;
    live->scale = rig.scale;
    live->rate_hz = options.loop.rate_hz;
    live->metadata = {
        {"simulated",
         "yes: the device, the hand and the object are simulated, and no value was measured on hardware"},
        {"device", rig.device.id}};
    live->simulated = true;
    live->transducer = transducer;
    return live;
}

}  // namespace palpate
