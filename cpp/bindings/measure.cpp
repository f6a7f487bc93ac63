// SPDX-License-Identifier: Apache-2.0
#include "palpate/run/measure.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <exception>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "bindings.hpp"
#include "palpate/rendering/measuring.hpp"
#include "palpate/simulation/simulated_device.hpp"
#include "palpate/simulation/test_rig.hpp"
#include "summary.hpp"

#ifdef PALPATE_HAS_USB
#include "palpate/device/usb.hpp"
#endif

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

namespace {

/// What somebody asked a probe for; the rest follows the device.
struct ProbeWish {
    bool wanted = false;
    std::optional<double> lower, upper, speed, stiffness, force_limit;

    [[nodiscard]] std::optional<ProbeSettings> granted(const TestRig& rig, double lowest,
                                                       double highest) const {
        if (!wanted) {
            return std::nullopt;
        }
        ProbeSettings probe =
            probe_for(rig.scale, rig.device, lower.value_or(lowest), upper.value_or(highest));
        probe.speed = speed.value_or(probe.speed);
        probe.stiffness = stiffness.value_or(probe.stiffness);
        probe.force_limit = force_limit.value_or(probe.force_limit);
        validate(probe);
        detail::require(rig.device.makes(probe.force_limit), "force_limit is " + readable(probe.force_limit) +
                                                                 ", the device makes " +
                                                                 readable(rig.device.force_limit));
        probe.force_limit = std::min(probe.force_limit, rig.device.force_limit);
        return probe;
    }
};

template <class Value>
py::array_t<Value> column(const std::vector<TickRecord>& ticks, Value TickRecord::* field) {
    py::array_t<Value> values(static_cast<py::ssize_t>(ticks.size()));
    auto* out = values.mutable_data();
    for (const TickRecord& tick : ticks) {
        *out++ = tick.*field;
    }
    return values;
}

py::dict columns(const std::vector<TickRecord>& ticks) {
    return py::dict(
        "time"_a = column(ticks, &TickRecord::time), "position"_a = column(ticks, &TickRecord::position),
        "velocity"_a = column(ticks, &TickRecord::velocity), "force"_a = column(ticks, &TickRecord::force),
        "applied"_a = column(ticks, &TickRecord::applied),
        "measured"_a = column(ticks, &TickRecord::measured),
        "device_time"_a = column(ticks, &TickRecord::device_time),
        "sequence"_a = column(ticks, &TickRecord::sequence));
}

/// What is measured, how long and by whom; `push` > 0: the device pushes the handle a little to either side.
struct Measurement {
    bool transducer = true;
    RecordUnits units;
    ProbeWish probe;
    std::optional<double> push;
    SessionSettings session;
    std::string record;
    bool force = false;  ///< replace an existing recording
    bool keep = false;
    std::optional<py::function> progress;
    std::optional<double> wait_s;  ///< for a packet of a device that paces the host
    double friction_share = 0.0;   ///< Coulomb friction of the simulated device, over its force limit
};

/// A measurement on a device that is described by `rig`. The device is not open yet; `told` is added to the
/// summary when it has been closed.
template <Device D, class Told>
py::dict measured_on(D& device, const TestRig& rig, const std::optional<ProbeSettings>& probe,
                     const Metadata& metadata, Measurement& wanted, Told told) {
    const double period_s = 1.0 / wanted.session.loop.rate_hz;
    GuardSettings guards = guards_for(rig.scale, rig.device);
    guards.ramp_s = probe || wanted.push ? guards.ramp_s : 0.0;  // what makes no force has none to begin with
    guards.force_limit = probe ? probe->force_limit : guards.force_limit;
    RecordSinks sinks;
    sinks.real_object = !wanted.push;
    sinks.keeps = wanted.keep;
    const Opened opened = device.open();
    detail::require(static_cast<bool>(opened), opened.reason);
    if (!wanted.record.empty()) {
        const std::string reason = sinks.file.open(wanted.record, wanted.units, metadata, wanted.force);
        if (!reason.empty()) {
            device.close();
            throw std::invalid_argument(reason);
        }
    }
    std::atomic<bool> asked{false};
    Watcher watcher{wanted.progress, &LoopProgress::object_force, asked};
    const auto watch = [&](const SessionView& view) { watcher(view); };
    const auto measured = [&](auto moves) {
        const py::gil_scoped_release unlocked;
        return measure_live(device, std::move(moves), guards, wanted.session, sinks, asked, watch);
    };
    const SessionReport report = probe         ? measured(Probe{*probe, period_s})
                                 : wanted.push ? measured(Pulses{{*wanted.push}, period_s})
                                               : measured(FreeMotion{});
    SessionExpectation expected{false, guards.encoder_step, {}, wanted.units.position, {}};
    const std::vector<std::string> notes = close_record(sinks, report, wanted.session.loop, wanted.units,
                                                        metadata, wanted.record, wanted.force, expected);
    watcher.rethrow();
    py::dict summary = summary_of(report, wanted.session.loop, sinks, wanted.record, notes, expected);
    summary["device"] = rig.device.id;
    summary["encoder_step"] = rig.device.encoder_step;
    summary["force_limit"] = rig.device.force_limit;
    summary["transducer"] = wanted.transducer;
    summary["position_range"] = std::pair{sinks.positions.lower, sinks.positions.upper};
    summary["force_range"] = std::pair{sinks.forces.lower, sinks.forces.upper};
    if (wanted.keep) {
        summary["profile"] = rig.device;
        summary["kept"] = columns(sinks.kept);
    }
    told(summary);
    return summary;
}

/// Returns the test rig for a mounted model; without one the default knob.
TestRig rig_with(const std::optional<ForceModel>& object, const RecordUnits& units, double period_s) {
    if (object) {
        return rig_for(*object, units.position == "rad", period_s);
    }
    TestRig rig;
    rig.device.period_s = period_s;
    return rig;
}

py::dict measure_on_simulated(const std::optional<ForceModel>& object, Measurement& wanted) {
    validate(wanted.session.loop);
    const double period_s = 1.0 / wanted.session.loop.rate_hz;
    TestRig rig = rig_with(object, wanted.units, period_s);
    const ProbeSettings standard;
    const std::optional<ProbeSettings> probe =
        wanted.probe.granted(rig, object ? object->domain().lower[0] : standard.lower,
                             object ? object->domain().upper[0] : standard.upper);
    if (probe || wanted.push) {
        rig.hand.stiffness = rig.hand.damping = 0.0;  // nobody holds a handle that moves by itself
    }
    rig.device.coulomb_friction = wanted.friction_share * rig.device.force_limit;
    validate(rig.device);
    SimulatedRig device{rig.device, rig.hand, simulated_substeps(period_s)};
    wanted.transducer = object && wanted.transducer;
    if (object) {
        device.mount({object_of(*object, rig, 0.0), wanted.transducer});
    }
    Metadata metadata = measured_metadata(std::string("palpate ") + PALPATE_VERSION, rig.device.id, probe,
                                          wanted.transducer, wanted.session.loop.rate_hz);
    metadata.insert(metadata.begin() + 1,
                    {"simulated", "yes: device, hand and object; nothing here was measured"});
    return measured_on(device, rig, probe, metadata, wanted, [](py::dict&) {});
}

#ifdef PALPATE_HAS_USB
/// What a device says of itself: it is opened without force, and closed again.
wire::Info identity_of(const std::string& serial, DeviceProfile& profile) {
    UsbDevice device{{.serial = serial, .makes_force = false}};
    const Opened opened = device.open();
    detail::require(static_cast<bool>(opened), opened.reason);
    profile = device.profile();
    return device.info();
}

py::dict measure_on_usb(const std::string& serial, Measurement& wanted) {
    TestRig rig;
    const wire::Info info = identity_of(serial, rig.device);
    wanted.session.loop.rate_hz = info.rate_hz;
    validate(wanted.session.loop);
    wanted.transducer = (info.capabilities & wire::has_transducer) != 0;
    detail::require(
        wanted.transducer || wanted.probe.wanted || wanted.record.empty(),
        rig.device.id +
            " has no force transducer, and its motor shows nothing of a force while somebody else "
            "moves the handle: probe instead");
    detail::require(!wanted.probe.wanted || wanted.probe.upper,
                    "a probe on a real device needs upper: how far it may go from the zero of its encoder");
    const ProbeSettings standard;
    wanted.probe.force_limit =
        wanted.probe.force_limit.value_or(std::min(standard.force_limit, rig.device.force_limit));
    const std::optional<ProbeSettings> probe = wanted.probe.granted(rig, standard.lower, standard.upper);
    UsbOptions options{.serial = serial, .makes_force = probe || wanted.push};
    if (wanted.wait_s) {
        options.wait = std::chrono::microseconds{std::llround(1e6 * *wanted.wait_s)};
    }
    UsbDevice device{options};
    Metadata metadata = measured_metadata(std::string("palpate ") + PALPATE_VERSION, rig.device.id, probe,
                                          wanted.transducer, wanted.session.loop.rate_hz);
    return measured_on(device, rig, probe, metadata, wanted, [&](py::dict& summary) {
        const UsbHealth health = device.health();
        summary["device"] = device.name().text();
        if (health.stream.delay.count() > 0) {  // a device may accept no command while it is disabled
            summary["round_trip"] = microseconds(health.stream.round_trip);
            summary["delay"] = microseconds(health.stream.delay);
        }
        summary["malformed"] = health.stream.malformed;
        summary["stalls"] = health.stalls;
        summary["bus_errors"] = health.bus_errors;
        summary["watchdog_trips"] = health.stream.watchdog_trips;
        summary["skipped_commands"] = health.skipped_commands;
        summary["timeouts"] = health.timeouts;
    });
}
#else
py::dict measure_on_usb(const std::string& /*serial*/, Measurement& /*wanted*/) {
    throw std::invalid_argument(
        "palpate was built without libusb: install libusb-1.0-0-dev, then palpate again");
}
#endif

}  // namespace

void bind_measure(py::module_& module) {
    const LoopSettings loop;
    const RealTimeOptions real_time;
    module.def(
        "measure",
        [](const std::string& device, const std::optional<ForceModel>& object, bool transducer,
           const std::string& position_unit, const std::string& force_unit, bool probe,
           std::optional<double> lower, std::optional<double> upper, std::optional<double> speed,
           std::optional<double> stiffness, std::optional<double> force_limit, std::optional<double> push,
           double rate_hz, double duration_s, const std::string& record, bool force, bool keep, int priority,
           int cpu, double lowest_rate_share, std::optional<double> wait_s,
           const std::optional<py::function>& progress, double friction_share) {
            detail::require(!wait_s || (*wait_s > 0.0 && *wait_s <= 10.0),
                            "wait_s is " + readable(wait_s.value_or(0.0)) + ", must be > 0 and at most 10");
            Measurement wanted{transducer,
                               {position_unit, force_unit == "N*m" ? "Nm" : force_unit},
                               {probe, lower, upper, speed, stiffness, force_limit},
                               push,
                               {},
                               record,
                               force,
                               keep,
                               progress,
                               wait_s,
                               friction_share};
            wanted.session.loop.rate_hz = rate_hz;
            wanted.session.loop.duration_s = duration_s;
            wanted.session.loop.lowest_rate_share = lowest_rate_share;
            wanted.session.real_time = {priority, cpu};
            if (device == "usb" || device.starts_with("usb:")) {
                return measure_on_usb(device.substr(std::min<std::size_t>(device.size(), 4)), wanted);
            }
            detail::require(device == "simulated",
                            "device is '" + device + "', must be simulated or usb[:SERIAL]");
            return measure_on_simulated(object, wanted);
        },
        "device"_a = "simulated", py::kw_only(), "object"_a = py::none(), "transducer"_a = true,
        "position_unit"_a = "rad", "force_unit"_a = "N*m", "probe"_a = false, "lower"_a = py::none(),
        "upper"_a = py::none(), "speed"_a = py::none(), "stiffness"_a = py::none(),
        "force_limit"_a = py::none(), "push"_a = py::none(), "rate_hz"_a = loop.rate_hz,
        "duration_s"_a = loop.duration_s, "record"_a = "", "force"_a = false, "keep"_a = false,
        "priority"_a = real_time.priority, "cpu"_a = real_time.cpu,
        "lowest_rate_share"_a = loop.lowest_rate_share, "wait_s"_a = py::none(), "progress"_a = py::none(),
        "friction_share"_a = 0.0,
        "A real object measured in real time; on the simulated device the model `object` is "
        "mounted.\n\n"
        "A hand moves the handle; with `probe` the device itself does, slowly between `lower` and `upper`;\n"
        "with `push` it gives short pushes of that force to either side. Blocks for `duration_s` (inf: "
        "until\n"
        "Ctrl-C) without holding the interpreter; `progress(ticks, position, force, lost)` is called ten "
        "times a\n"
        "second. A packet of a USB device is waited for `wait_s`. `record` names the recording, which grows "
        "as\n"
        "record.part; an existing one is refused, or replaced with `force`. With `keep` the summary, "
        "returned\n"
        "by name, holds the ticks. `friction_share` is the Coulomb friction of the simulated device, over "
        "its "
        "force\nlimit. ValueError where it is refused before anything moves.");
}

}  // namespace palpate::bindings
