// SPDX-License-Identifier: Apache-2.0
#include "inverse3.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>

#include "certified.hpp"
#include "palpate/device/inverse3.hpp"
#include "rendering.hpp"

namespace palpate::control {

namespace {

constexpr double usual_force_limit = 2.0;  ///< the service tells no largest force [N]

/// The part of the device's name after "inverse3".
Inverse3Settings settings_of(const Options& options) {
    Inverse3Settings settings = inverse3_settings(options.device.substr(std::string("inverse3").size()));
    if (options.wait_ms) {
        settings.answer_within = std::chrono::milliseconds{std::llround(std::ceil(*options.wait_ms))};
    }
    return settings;
}

/// What is known of it: its name and unit, and how often the host asks. Nobody tells its mechanics; where a
/// certificate counts on them, they are the certificate's.
DeviceProfile profile_of(const Inverse3Info& info, const Options& options, const ModelFile& file,
                         DeviceProfile otherwise) {
    if (!options.uncertified && file.certificate) {
        otherwise = file.certificate->device;
    } else {
        otherwise.force_limit = options.force_limit.value_or(usual_force_limit);
    }
    otherwise.id = info.type + "-" + info.id;
    otherwise.period_s = 1.0 / options.loop.rate_hz;
    otherwise.position_unit = "m";
    return otherwise;
}

std::string filters_of(const Inverse3Info& info) {
    return "force gate " + readable(info.force_gate) + ", damping " + readable(info.damping);
}

}  // namespace

int run_on_inverse3(const Options& options, ModelFile file, RecordUnits units) {
    if (file.position_unit != "m" || file.force_unit != "N") {
        refuse(options.model + " is in " + (file.position_unit.empty() ? "no unit" : file.position_unit) +
               " and " + (file.force_unit.empty() ? "no unit" : file.force_unit) +
               "; an Inverse3 moves along a line: it takes models in m and N");
    }
    Inverse3Device device{settings_of(options)};
    if (const Opened opened = device.open(); !opened) {
        refuse("--device " + options.device + ": " + opened.reason);
    }
    TestRig rig = rig_for(file.model, false, 1.0 / options.loop.rate_hz);
    rig.device = profile_of(device.info(), options, file, rig.device);
    const Job job = job_on_real_device(options, std::move(file), std::move(units), rig);
    const Inverse3Info info = device.info();
    const Metadata about{{"device", rig.device.id + " through the Haply Inverse Service, " + options.device},
                         {"service", filters_of(info)},
                         {"certified", options.uncertified ? "no: --uncertified was given" : "yes"}};
    const std::string called = rig.device.id + " (the service's " + filters_of(info) + ")" +
                               (options.uncertified ? ", uncertified," : "");
    return render_on(device, called, options, job, about, [&] {
        return Story{{{"service", filters_of(info)}},
                     {{"inverse3", {{"force_gate", info.force_gate}, {"damping", info.damping}}}}};
    });
}

}  // namespace palpate::control
