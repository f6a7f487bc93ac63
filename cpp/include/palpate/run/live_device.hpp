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

/// Fields and lines that a device adds to a summary.
struct DeviceReport {
    std::string name;  ///< name of the field that holds `fields`; empty without them
    NamedValues fields;
    Lines lines;
};

/// A device that is chosen at run time, with its properties. It is a `Device`.
class LiveDevice {
  public:
    LiveDevice() = default;
    LiveDevice(const LiveDevice&) = delete;
    LiveDevice& operator=(const LiveDevice&) = delete;
    virtual ~LiveDevice() = default;

    [[nodiscard]] virtual Opened open() = 0;
    [[nodiscard]] virtual Reading exchange(const Command& command) noexcept = 0;
    virtual void close() noexcept = 0;
    /// Returns true if its exchange waits for the clock of the device.
    [[nodiscard]] virtual bool sets_pace() const noexcept = 0;
    /// Returns the events of the device so far.
    [[nodiscard]] virtual DeviceReport report() const = 0;

    std::string title;  ///< name in messages
    DeviceProfile profile;
    ModelScale scale;        ///< of the model relative to the default knob
    double rate_hz = 0.0;    ///< ticks a second
    Metadata metadata;       ///< head of recordings
    bool simulated = false;  ///< true if no real device moves
    bool transducer = true;  ///< true if the device measures the force
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
    ~LiveDeviceOf() override { device_.close(); }

    [[nodiscard]] Opened open() override { return device_.open(); }
    [[nodiscard]] Reading exchange(const Command& command) noexcept override {
        return device_.exchange(command);
    }
    void close() noexcept override { device_.close(); }
    [[nodiscard]] bool sets_pace() const noexcept override { return paces_host<D>; }
    [[nodiscard]] DeviceReport report() const override { return report_ ? report_(device_) : DeviceReport{}; }

    [[nodiscard]] D& device() noexcept { return device_; }

  private:
    D device_;
    Report report_;
};

static_assert(Device<LiveDevice>);

}  // namespace palpate
