// SPDX-License-Identifier: Apache-2.0
#include "usb.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>

#include "certified.hpp"
#include "palpate/device/usb.hpp"
#include "rendering.hpp"

namespace palpate::control {

namespace {

UsbOptions usb_options(const Options& options) {
    UsbOptions usb;
    if (const std::size_t colon = options.device.find(':'); colon != std::string::npos) {
        usb.serial = options.device.substr(colon + 1);
    }
    if (options.wait_ms) {
        usb.wait = std::chrono::microseconds{std::llround(1e3 * *options.wait_ms)};
    }
    return usb;
}

void require_fitting(const Options& options, const ModelFile& file, const UsbDevice& device) {
    if (file.position_unit != "rad" || file.force_unit != "N*m") {
        refuse(options.model + " is in " + (file.position_unit.empty() ? "no unit" : file.position_unit) +
               " and " + (file.force_unit.empty() ? "no unit" : file.force_unit) + "; " +
               device.name().text() + " turns: it takes models in rad and N*m");
    }
    if (std::abs(options.loop.rate_hz - device.info().rate_hz) > 0.5) {
        const std::string rate = std::to_string(device.info().rate_hz);
        refuse("--rate-hz is " + readable(options.loop.rate_hz) + "; " + device.name().text() + " sends " +
               rate + " packets a second and paces the loop: choose --rate-hz " + rate);
    }
}

Story story_of(const UsbDevice& device) {
    const UsbHealth health = device.health();
    const StreamHealth& stream = health.stream;
    const double sample_us = 1e6 / device.info().rate_hz;
    const auto samples = [&](double share) { return 1e-3 * stream.delay.quantile(share) / sample_us; };
    const auto number = [](std::uint64_t count) { return std::to_string(count); };
    return {
        {{"round trip", percentiles(stream.round_trip)},
         {"delay",
          "p50 " + readable(samples(0.5)) + ", p99 " + readable(samples(0.99)) + ", max " +
              readable(samples(1.0)) + " samples, from a sample to the force made of it" +
              (stream.late_commands == 0 ? ""
                                         : "; " + number(stream.late_commands) + " later than certified")},
         {"wire", number(stream.packets) + " packets, " + number(stream.lost) + " lost, " +
                      number(stream.repeated) + " repeated, " + number(stream.malformed) + " malformed, " +
                      number(health.discarded) + " discarded; " + number(health.skipped_commands) +
                      " commands skipped, " + number(health.lost_commands) + " lost, " +
                      number(stream.refused_commands) + " refused, " + number(stream.late_echoes) +
                      " late echoes; " + number(health.timeouts) + " timeouts, " + number(health.stalls) +
                      " stalls, " + number(health.bus_errors) + " bus errors, " +
                      number(stream.watchdog_trips) + " watchdog trips"}},
        {{"usb",
          {{"packets", stream.packets},
           {"lost", stream.lost},
           {"repeated", stream.repeated},
           {"malformed", stream.malformed},
           {"discarded", health.discarded},
           {"skipped_commands", health.skipped_commands},
           {"refused_commands", stream.refused_commands},
           {"late_echoes", stream.late_echoes},
           {"late_commands", stream.late_commands},
           {"timeouts", health.timeouts},
           {"stalls", health.stalls},
           {"bus_errors", health.bus_errors},
           {"watchdog_trips", stream.watchdog_trips},
           {"round_trip", microseconds(stream.round_trip)},
           {"delay_samples", {{"p50", samples(0.5)}, {"p99", samples(0.99)}, {"max", samples(1.0)}}}}}}};
}

}  // namespace

bool has_usb() noexcept {
    return true;
}

int run_on_usb(const Options& options, ModelFile file, RecordUnits units) {
    UsbOptions usb = usb_options(options);
    if (!options.uncertified && file.certificate) {
        // A command that comes later than that is one that nobody certified.
        const DeviceProfile& certified = file.certificate->device;
        usb.longest_delay_s = certified.delay_s;
    }
    UsbDevice device{std::move(usb)};
    if (const Opened opened = device.open(); !opened) {
        refuse("--device " + options.device + ": " + opened.reason);
    }
    require_fitting(options, file, device);
    TestRig rig = rig_for(file.model, true, 1.0 / device.info().rate_hz);
    rig.device = device.profile(rig.device);
    const Job job = job_on_real_device(options, std::move(file), std::move(units), rig);
    const Metadata about{{"device", device.name().text()},
                         {"certified", options.uncertified ? "no: --uncertified was given" : "yes"}};
    return render_on(device, device.name().text() + (options.uncertified ? ", uncertified," : ""), options,
                     job, about, [&] { return story_of(device); });
}

}  // namespace palpate::control
