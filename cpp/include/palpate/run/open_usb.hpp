// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "palpate/fields/readable.hpp"
#include "palpate/fields/value.hpp"
#include "palpate/rendering/measuring.hpp"
#include "palpate/run/live_device.hpp"
#include "palpate/run/measure.hpp"
#include "palpate/run/render.hpp"
#include "palpate/run/session_text.hpp"
#include "palpate/stability/certificate.hpp"

#ifdef PALPATE_HAS_USB
#include "palpate/device/usb.hpp"
#endif

namespace palpate {

#ifdef PALPATE_HAS_USB

namespace detail {

/// Returns the counters and delays of a USB device for the summary of a run.
[[nodiscard]] inline DeviceReport usb_report(const UsbDevice& device) {
    const UsbHealth health = device.health();
    const StreamHealth& stream = health.stream;
    const double sample_us = 1e6 / device.info().rate_hz;
    const auto samples = [&](double share) { return 1e-3 * stream.delay.quantile(share) / sample_us; };
    const auto number = [](std::uint64_t count) { return std::to_string(count); };
    DeviceReport report{
        "usb",
        {{"packets", stream.packets},
         {"lost", stream.lost},
         {"repeated", stream.repeated},
         {"malformed", stream.malformed},
         {"discarded", health.discarded},
         {"skipped_commands", health.skipped_commands},
         {"lost_commands", health.lost_commands},
         {"refused_commands", stream.refused_commands},
         {"late_echoes", stream.late_echoes},
         {"timeouts", health.timeouts},
         {"stalls", health.stalls},
         {"bus_errors", health.bus_errors},
         {"watchdog_trips", stream.watchdog_trips}},
        {{"round trip", percentiles(stream.round_trip)},
         {"delay", "p50 " + readable(samples(0.5)) + ", p99 " + readable(samples(0.99)) + ", max " +
                       readable(samples(1.0)) + " samples, from a sample to the force computed from it"},
         {"wire", number(stream.packets) + " packets, " + number(stream.lost) + " lost, " +
                      number(stream.repeated) + " repeated, " + number(stream.malformed) + " malformed, " +
                      number(health.discarded) + " discarded; " + number(health.skipped_commands) +
                      " commands skipped, " + number(health.lost_commands) + " lost, " +
                      number(stream.refused_commands) + " refused, " + number(stream.late_echoes) +
                      " late echoes; " + number(health.timeouts) + " timeouts, " + number(health.stalls) +
                      " stalls, " + number(health.bus_errors) + " bus errors, " +
                      number(stream.watchdog_trips) + " watchdog trips"}}};
    if (stream.delay.count() > 0) {  // without a confirmed command there are no delays to report
        report.fields.push_back({"round_trip", fields(stream.round_trip)});
        report.fields.push_back({"delay", fields(stream.delay)});
        report.fields.push_back(
            {"delay_samples",
             NamedValues{{"p50", samples(0.5)}, {"p99", samples(0.99)}, {"max", samples(1.0)}}});
    }
    return report;
}

/// Returns the model that a device must contain so that it renders the plan of a certificate.
[[nodiscard]] inline wire::DeviceModel device_model_of(const Certificate& certificate) {
    const auto bits = [](const std::string& digits) {
        std::uint64_t value = 0;
        const auto end = std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
        require(end.ec == std::errc{} && end.ptr == digits.data() + digits.size(),
                "the fingerprint '" + digits + "' of the certificate is not a hexadecimal number");
        return value;
    };
    return {bits(certificate.model), bits(certificate.fingerprint),
            static_cast<std::uint32_t>(std::lround(1.0 / certificate.device.period_s)),
            wire::Renderer::Device};
}

/// Returns the USB options of a device named usb[:SERIAL].
[[nodiscard]] inline UsbOptions usb_options(const RunOptions& options) {
    UsbOptions usb;
    if (const std::size_t colon = options.device.find(':'); colon != std::string::npos) {
        usb.serial = options.device.substr(colon + 1);
    }
    if (options.wait_s) {
        usb.wait = std::chrono::microseconds{std::llround(1e6 * *options.wait_s)};
    }
    return usb;
}

}  // namespace detail

/// Opens a USB device for rendering. Throws std::invalid_argument with the reason if that is not possible.
[[nodiscard]] inline std::unique_ptr<LiveDevice> open_usb(const RenderOptions& options,
                                                          const PlannedModel& model) {
    UsbOptions usb = detail::usb_options(options);
    if (rendered_by_device(options, model)) {
        usb.device_renders = true;
        usb.model = detail::device_model_of(*model.certificate);
    }
    auto live = std::make_unique<LiveDeviceOf<UsbDevice>>(UsbDevice{std::move(usb)}, detail::usb_report);
    if (const Opened opened = live->open(); !opened) {
        refuse("device " + options.device + ": " + opened.reason);
    }
    const UsbDevice& device = live->device();
    const std::string name = device.name().text();
    if (model.position_unit != "rad" || model.force_unit != "N*m") {
        refuse(model.units_text() + "; " + name + " rotates and needs a model in rad and N*m");
    }
    if (std::abs(options.loop.rate_hz - device.info().rate_hz) > 0.5) {
        const std::string rate = std::to_string(device.info().rate_hz);
        refuse("rate_hz is " + readable(options.loop.rate_hz) + "; " + name + " sends " + rate +
               " packets a second and sets the rate of the loop: must be " + rate);
    }
    live->title = name + (options.uncertified ? ", uncertified," : "");
    live->profile = device.profile();
    live->rate_hz = options.loop.rate_hz;
    live->metadata = {{"device", name}};
    if (rendered_by_device(options, model)) {
        live->metadata.emplace_back("device_model", model.certificate->model);
    }
    return live;
}

/// Returns a USB device for a measurement, not open yet. The device makes force only if `probe` or `push` is set.
[[nodiscard]] inline std::unique_ptr<LiveDevice> usb_to_measure(MeasureOptions& options) {
    UsbOptions usb = detail::usb_options(options);
    usb.makes_force = false;
    UsbDevice listener{usb};
    const Opened opened = listener.open();
    detail::require(static_cast<bool>(opened), opened.reason);
    const DeviceProfile profile = listener.profile();
    const wire::Info info = listener.info();
    const std::string name = listener.name().text();
    const std::optional<wire::DeviceModel> own_model = listener.model();
    listener.close();
    detail::require(!options.probe || options.upper,
                    "a probe on a real device needs upper, the largest position of its target from the zero "
                    "of the encoder");
    options.force_limit =
        options.force_limit.value_or(std::min(ProbeSettings{}.force_limit, profile.force_limit));
    usb.makes_force = options.moves() || options.device_renders;
    usb.device_renders = options.device_renders;
    auto live = std::make_unique<LiveDeviceOf<UsbDevice>>(UsbDevice{std::move(usb)}, detail::usb_report);
    live->title = name;
    live->profile = profile;
    live->rate_hz = info.rate_hz;
    live->metadata = {{"device", profile.id}};
    if (own_model) {
        live->metadata.emplace_back("device_model", wire::fingerprint_text(own_model->fingerprint));
    }
    live->transducer = (info.capabilities & wire::has_transducer) != 0;
    return live;
}

#else

/// Throws std::invalid_argument, because this build of palpate does not include libusb.
[[noreturn]] inline void refuse_usb(const RunOptions& options) {
    refuse("device " + options.device +
           ": palpate was built without libusb; install libusb-1.0-0-dev and build palpate again");
}

[[nodiscard]] inline std::unique_ptr<LiveDevice> open_usb(const RenderOptions& options,
                                                          const PlannedModel& /*model*/) {
    refuse_usb(options);
}

[[nodiscard]] inline std::unique_ptr<LiveDevice> usb_to_measure(MeasureOptions& options) {
    refuse_usb(options);
}

#endif

}  // namespace palpate
