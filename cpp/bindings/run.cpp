// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <cmath>
#include <cstddef>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "bindings.hpp"
#include "palpate/run/measure.hpp"
#include "palpate/run/render.hpp"
#include "palpate/run/summary.hpp"
#include "palpate/run/transports.hpp"
#include "palpate/simulation/open_device.hpp"
#include "palpate/version.hpp"
#include "settings.hpp"

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

namespace {

/// Calls Python functions while a run continues without the lock of the Python interpreter: the signal handlers, and
/// ten times a second `progress(ticks, position, force, lost)`. An exception in `progress` ends the run and is raised
/// after the run; Ctrl-C only ends the run.
class Watcher {
  public:
    Watcher(const std::optional<py::function>& progress, std::atomic<double> LoopProgress::* force)
        : progress_{progress}, force_{force} {}

    void operator()(const SessionView& view) {
        const py::gil_scoped_acquire locked;
        if (PyErr_CheckSignals() != 0) {
            PyErr_Clear();
            stop_requested.store(true, std::memory_order_relaxed);
        }
        if (!progress_ || error_ || views_++ % views_a_call != 0) {
            return;
        }
        try {
            (*progress_)(view.progress.ticks.load(std::memory_order_relaxed),
                         view.progress.position.load(std::memory_order_relaxed),
                         (view.progress.*force_).load(std::memory_order_relaxed),
                         view.progress.lost.load(std::memory_order_relaxed));
        } catch (const py::error_already_set& error) {
            if (!error.matches(PyExc_KeyboardInterrupt)) {
                error_ = std::current_exception();
            }
            stop_requested.store(true, std::memory_order_relaxed);
        }
    }

    void rethrow() const {
        if (error_) {
            std::rethrow_exception(error_);
        }
    }

    std::atomic<bool> stop_requested{false};

  private:
    static constexpr int views_a_call = 5;
    const std::optional<py::function>& progress_;
    std::atomic<double> LoopProgress::* force_;
    std::exception_ptr error_;
    int views_ = 0;
};

py::object python_of(const NamedValues& fields);

py::object python_of(std::monostate /*nothing*/) {
    return py::none();
}

py::object python_of(double value) {
    return std::isfinite(value) ? py::object(py::float_(value)) : py::none();
}

py::object python_of(const std::string& text) {
    return text_of(text);
}

py::object python_of(const std::pair<std::string, std::string>& line) {
    return py::make_tuple(text_of(line.first), text_of(line.second));
}

template <class T>
py::object python_of(const T& value) {
    return py::cast(value);
}

template <class T>
py::object python_of(const std::vector<T>& values) {
    py::list list;
    for (const T& value : values) {
        list.append(python_of(value));
    }
    return list;
}

py::object python_of(const NamedValues& fields) {
    py::dict dict;
    for (const NamedValue& field : fields) {
        dict[py::str(field.name)] =
            std::visit([](const auto& value) { return python_of(value); }, field.value);
    }
    return dict;
}

/// Returns one field of the records of all ticks as a numpy array.
template <class Value>
py::array_t<Value> column(const std::vector<TickRecord>& ticks, Value TickRecord::* field) {
    py::array_t<Value> values(static_cast<py::ssize_t>(ticks.size()));
    auto* out = values.mutable_data();
    for (const TickRecord& tick : ticks) {
        *out++ = tick.*field;
    }
    return values;
}

/// Sets the options of a run from Python keywords, and checks the option wait_s.
template <class T>
void set_options(T& options, const py::kwargs& given) {
    set_fields(options, given);
    options.created_by = std::string("palpate ") + library_version;
    detail::require(!options.wait_s || (*options.wait_s > 0.0 && *options.wait_s <= 10.0),
                    "wait_s is " + readable(options.wait_s.value_or(0.0)) + ", must be > 0 and at most 10");
}

/// Renders a model on a device and returns the values of the summary as a dict.
py::dict render_in_python(const ForceModel& model, const std::optional<Scheme>& plan,
                          const std::optional<ForceModel>& limited,
                          const std::optional<Certificate>& certificate, const std::string& position_unit,
                          const std::string& force_unit, const std::string& model_name,
                          const std::vector<std::string>& findings,
                          const std::optional<py::function>& progress, const py::kwargs& given) {
    RenderOptions options;
    set_options(options, given);
    options.rate_given = given.contains("rate_hz") && !given["rate_hz"].is_none();
    const PlannedModel planned{model_name, model,   position_unit, force_unit,
                               plan,       limited, certificate,   findings};
    const auto device = [&] {
        const py::gil_scoped_release unlocked;  // a device may answer slowly
        return open_device(options, planned);
    }();
    RecordSinks sinks;
    const RenderJob job = prepare_rendering(options, planned, *device, sinks);
    Watcher watcher{progress,
                    rendered_by_device(options, planned) ? &LoopProgress::applied : &LoopProgress::force};
    const auto summary = [&] {
        const py::gil_scoped_release unlocked;
        return render(options, planned, job, *device, sinks, watcher.stop_requested, std::ref(watcher));
    }();
    watcher.rethrow();
    py::dict result = python_of(fields(summary));
    result["lines"] = python_of(lines(summary));
    return result;
}

/// Measures an object on a device and returns the values of the summary as a dict.
py::dict measure_in_python(const std::optional<ForceModel>& object, const std::string& position_unit,
                           const std::string& force_unit, const std::optional<py::function>& progress,
                           const py::kwargs& given) {
    MeasureOptions options;
    set_options(options, given);
    options.units = record_units(position_unit, force_unit);
    const auto device = [&] {
        const py::gil_scoped_release unlocked;
        return device_to_measure(options, object);
    }();
    Watcher watcher{progress, &LoopProgress::object_force};
    const auto summary = [&] {
        const py::gil_scoped_release unlocked;
        return measure(options, *device, watcher.stop_requested, std::ref(watcher));
    }();
    watcher.rethrow();
    py::dict result = python_of(fields(summary));
    result["encoder_step"] = device->profile.encoder_step;
    result["force_limit"] = device->profile.force_limit;
    result["transducer"] = device->transducer;
    result["device_model"] = py::none();
    for (const auto& [key, value] : device->metadata) {
        if (key == "device_model") {
            result["device_model"] = value;
        }
    }
    if (result.contains("usb")) {
        result.attr("update")(result.attr("pop")("usb"));
    }
    if (options.keep) {
        const std::vector<TickRecord>& ticks = summary.kept;
        result["profile"] = device->profile;
        result["kept"] = py::dict(
            "time"_a = column(ticks, &TickRecord::time), "position"_a = column(ticks, &TickRecord::position),
            "velocity"_a = column(ticks, &TickRecord::velocity),
            "force"_a = column(ticks, &TickRecord::force), "applied"_a = column(ticks, &TickRecord::applied),
            "measured"_a = column(ticks, &TickRecord::measured),
            "device_time"_a = column(ticks, &TickRecord::device_time),
            "sequence"_a = column(ticks, &TickRecord::sequence));
    }
    return result;
}

}  // namespace

void bind_run(py::module_& module) {
    module.attr("device_help") = transport_help(false);
    module.attr("measured_device_help") = transport_help(true);
    module.attr("device_waits") = transport_waits();
    py::tuple forms{transports.size()};
    for (std::size_t k = 0; k < transports.size(); ++k) {
        forms[k] = py::make_tuple(transports[k].name, transports[k].form, transports[k].help);
    }
    module.attr("transports") = forms;
    module.attr("usual_telemetry_hz") = Telemetry::usual_hz;
    py::class_<LoopSettings>(module, "LoopSettings", "Default rate, duration and least rate of a run.")
        .def(py::init<>())
        .def_readonly("rate_hz", &LoopSettings::rate_hz)
        .def_readonly("duration_s", &LoopSettings::duration_s)
        .def_readonly("lowest_rate_share", &LoopSettings::lowest_rate_share);
    module.def(
        "render", &render_in_python, "model"_a, "plan"_a = py::none(), py::kw_only(),
        "limited"_a = py::none(), "certificate"_a = py::none(), "position_unit"_a = "rad",
        "force_unit"_a = "N*m", "model_name"_a = "", "findings"_a = std::vector<std::string>{},
        "progress"_a = py::none(),
        "Renders a model in real time on a device: the loop of palpate-control.\n\n"
        "`plan`, `limited` and `certificate` are read from the model file; `limited` is the model that the "
        "plan\n"
        "renders instead. `findings` are the defects of the model, which the verdict repeats. Without a "
        "plan\n"
        "the default scheme is used. Options are keywords, None for the default:\n\n"
        "- device (see `transports`), wait_s, uncertified, faults.\n"
        "- rate_hz, duration_s (inf: until Ctrl-C), lowest_rate_share, priority, cpu.\n"
        "- force_limit and the fields of a scheme.\n"
        "- record, force, telemetry_port, telemetry_hz.\n\n"
        "`record` is the name of the recording, which is written as record.part and renamed at the end. If "
        "the\n"
        "recording exists, it is replaced with `force`, otherwise the call is refused. Calls\n"
        "progress(ticks, position, force, lost) ten times a second.\n\n"
        "Returns the values of the summary by name, and the text of the summary under `lines`. Raises "
        "InputError\n"
        "if the rendering is refused, before the device moves.");
    module.def(
        "measure", &measure_in_python, py::kw_only(), "object"_a = py::none(), "position_unit"_a = "rad",
        "force_unit"_a = "N*m", "progress"_a = py::none(),
        "Measures a real object in real time; on the simulated device the model `object` is mounted.\n\n"
        "A hand moves the handle. With `probe` the device moves it slowly between `lower` and `upper`. With\n"
        "`push` the device gives short pushes of up to this force to either side. Options are keywords,\n"
        "None for the default:\n\n"
        "- device (see `transports`), wait_s.\n"
        "- rate_hz, duration_s (inf: until Ctrl-C), lowest_rate_share, priority, cpu.\n"
        "- probe, lower, upper, speed, stiffness, force_limit, push.\n"
        "- record, force, keep.\n"
        "- transducer, friction_share (Coulomb friction of the simulated device / its force limit).\n"
        "- device_renders: a USB device renders its own model, and its force is recorded.\n\n"
        "Calls progress(ticks, position, force, lost) ten times a second.\n\n"
        "Returns the values of the summary by name; with `keep` the columns of all ticks are under `kept`.\n"
        "Raises InputError if the measurement is refused, before the device moves.");
}

}  // namespace palpate::bindings
