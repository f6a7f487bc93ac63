// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <utility>

#include "palpate/device/device.hpp"
#include "palpate/device/device_profile.hpp"
#include "palpate/fields/value.hpp"
#include "palpate/io/recording_file.hpp"
#include "palpate/rendering/scale.hpp"

namespace palpate {

/// Values and text lines that a device adds to the summary of a run.
struct DeviceReport {
    std::string name;  ///< key in the summary under which `fields` appear; empty: none
    NamedValues fields;
    Lines lines;
};

/// Base class of a device that is chosen while the program runs, with the properties of the device.
class LiveDevice {
  public:
    LiveDevice() = default;
    LiveDevice(const LiveDevice&) = delete;
    LiveDevice& operator=(const LiveDevice&) = delete;
    virtual ~LiveDevice() = default;

    [[nodiscard]] virtual Opened open() = 0;
    [[nodiscard]] virtual Reading exchange(const Command& command) noexcept = 0;
    virtual ZeroForce close() noexcept = 0;
    /// Returns true if the device's clock sets the rate of the control loop: `exchange` waits for the next sample.
    [[nodiscard]] virtual bool sets_pace() const noexcept = 0;
    /// Returns the counters of the device since it was opened, for the summary.
    [[nodiscard]] virtual DeviceReport report() const = 0;

    std::string title;  ///< name of the device in messages
    DeviceProfile profile;
    ModelScale scale;        ///< the model's factors for default positions and forces
    double rate_hz = 0.0;    ///< ticks of the control loop a second
    Metadata metadata;       ///< metadata of the device for recordings
    bool simulated = false;  ///< true for a simulated device
    bool transducer = true;  ///< true if the device has a force transducer
};

/// Wraps a device of any type as a `LiveDevice`.
template <Device D>
class LiveDeviceOf final : public LiveDevice {
  public:
    using Report = std::function<DeviceReport(const D&)>;

    explicit LiveDeviceOf(D device, Report report = {})
        : device_{std::move(device)}, report_{std::move(report)} {}
    LiveDeviceOf(const LiveDeviceOf&) = delete;
    LiveDeviceOf& operator=(const LiveDeviceOf&) = delete;
    ~LiveDeviceOf() override { (void)closed(device_); }

    [[nodiscard]] Opened open() override { return device_.open(); }
    [[nodiscard]] Reading exchange(const Command& command) noexcept override {
        return device_.exchange(command);
    }
    ZeroForce close() noexcept override { return closed(device_); }
    [[nodiscard]] bool sets_pace() const noexcept override { return paces_host<D>; }
    [[nodiscard]] DeviceReport report() const override { return report_ ? report_(device_) : DeviceReport{}; }

    [[nodiscard]] D& device() noexcept { return device_; }

  private:
    D device_;
    Report report_;
};

static_assert(Device<LiveDevice>);

}  // namespace palpate
