// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <libusb-1.0/libusb.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "palpate/device/detail/usb_text.hpp"
#include "palpate/device/device.hpp"
#include "palpate/device/wire.hpp"

namespace palpate {

/// Name, serial number and bus address of a USB device, for messages and to find the device again.
struct UsbName {
    std::string manufacturer;
    std::string product;
    std::string serial;
    int bus = 0;
    int address = 0;

    /// Returns the name as a text such as "emulated knob EMU-1 (bus 1, address 2)".
    [[nodiscard]] std::string text() const {
        const std::string place =
            "(bus " + std::to_string(bus) + ", address " + std::to_string(address) + ")";
        return (product.empty() ? "USB device" : product) + (serial.empty() ? " " : " " + serial + " ") +
               place;
    }
};

namespace detail {

/// Ends the use of libusb (its context) when the std::unique_ptr that owns it is destroyed.
struct CloseContext {
    void operator()(libusb_context* context) const noexcept { libusb_exit(context); }
};
/// Closes an open USB device when the std::unique_ptr that owns its libusb handle is destroyed.
struct CloseHandle {
    void operator()(libusb_device_handle* handle) const noexcept {
        libusb_release_interface(handle, wire::interface_number);
        libusb_close(handle);
    }
};
/// Frees libusb's list of USB devices when the std::unique_ptr that owns the list is destroyed.
struct FreeList {
    void operator()(libusb_device** list) const noexcept { libusb_free_device_list(list, 1); }
};

/// Connection to one suitable USB device, whose interface is reserved for this program.
class UsbConnection {
  public:
    /// Opens the device with this serial number, or the only device if `serial` is empty.
    [[nodiscard]] Opened open(const std::string& serial) {
        libusb_context* context = nullptr;
        if (const int code = libusb_init(&context); code != 0) {
            return {"libusb cannot start: " + usb_reason(code)};
        }
        context_.reset(context);
        Opened opened = choose(serial);
        if (!opened) {
            close();
        }
        return opened;
    }

    /// Releases the device.
    void close() noexcept {
        handle_.reset();
        context_.reset();
    }

    /// Sends a control request without data to the device. Returns 0 or an error code of libusb.
    [[nodiscard]] int request(wire::Request request, std::uint16_t value) const noexcept {
        const int transferred = libusb_control_transfer(
            handle_.get(), wire::request_to_device, static_cast<std::uint8_t>(request), value,
            wire::interface_number, nullptr, 0, wire::request_timeout_ms);
        return transferred < 0 ? transferred : 0;
    }

    /// Reads the model that the device can render itself. Returns nothing if the device has none.
    [[nodiscard]] std::optional<wire::DeviceModel> model() const {
        std::array<std::uint8_t, wire::largest_packet> bytes{};
        const int size = read(handle_.get(), wire::Request::GetModel, bytes);
        wire::DeviceModel model;
        const bool known =
            size >= 0 && wire::decode(std::span{bytes}.first(static_cast<std::size_t>(size)), model).empty();
        return known ? std::optional{model} : std::nullopt;
    }

    [[nodiscard]] libusb_context* context() const noexcept { return context_.get(); }
    [[nodiscard]] libusb_device_handle* handle() const noexcept { return handle_.get(); }
    [[nodiscard]] const UsbName& name() const noexcept { return name_; }
    [[nodiscard]] const wire::Info& info() const noexcept { return info_; }

  private:
    using Handle = std::unique_ptr<libusb_device_handle, CloseHandle>;

    /// A suitable USB device that is already open.
    struct Candidate {
        Handle handle;
        UsbName name;
        wire::Info info;
    };

    /// Reads the answer to a control request. Returns its size or an error code of libusb.
    [[nodiscard]] static int read(libusb_device_handle* handle, wire::Request request,
                                  std::span<std::uint8_t> bytes) noexcept {
        return libusb_control_transfer(handle, wire::request_to_host, static_cast<std::uint8_t>(request), 0,
                                       wire::interface_number, bytes.data(),
                                       static_cast<std::uint16_t>(bytes.size()), wire::request_timeout_ms);
    }

    /// Opens the only suitable USB device. Returns a reason if there is no suitable device or more than one.
    [[nodiscard]] Opened choose(const std::string& serial) {
        libusb_device** found = nullptr;
        const auto count = libusb_get_device_list(context_.get(), &found);
        if (count < 0) {
            return {"the USB devices cannot be listed: " + usb_reason(static_cast<int>(count))};
        }
        const std::unique_ptr<libusb_device*, FreeList> list{found};
        std::vector<Candidate> suitable;
        std::vector<std::string> others;   // serial numbers that differ from the requested serial number
        std::vector<std::string> reasons;  // for each unsuitable device, why palpate cannot use it
        for (libusb_device* device : std::span{found, static_cast<std::size_t>(count)}) {
            if (is_ours(device)) {
                examine(device, serial, suitable, others, reasons);
            }
        }
        if (suitable.size() == 1) {
            handle_ = std::move(suitable.front().handle);
            name_ = suitable.front().name;
            info_ = suitable.front().info;
            return {};
        }
        return {refusal(serial, suitable, others, reasons)};
    }

    /// Returns the message for the case that there is no suitable USB device, or more than one.
    [[nodiscard]] static std::string refusal(const std::string& serial,
                                             const std::vector<Candidate>& suitable,
                                             const std::vector<std::string>& others,
                                             const std::vector<std::string>& reasons) {
        const auto listed = [](std::vector<std::string> words) {
            std::sort(words.begin(), words.end());
            std::string text;
            for (const std::string& word : words) {
                text += (text.empty() ? "" : ", ") + word;
            }
            return text;
        };
        if (!suitable.empty()) {
            std::vector<std::string> serials;
            serials.reserve(suitable.size());
            for (const Candidate& candidate : suitable) {
                serials.push_back(candidate.name.serial);
            }
            return std::to_string(suitable.size()) + " suitable USB devices are connected (" +
                   listed(serials) + "): choose one with usb:SERIAL";
        }
        if (!reasons.empty()) {
            return reasons.front();
        }
        if (!others.empty()) {
            return "no USB device has the serial number " + serial + "; connected: " + listed(others);
        }
        return "no USB device 1209:0001 with this protocol is connected; 'lsusb -d 1209:0001' lists those "
               "that the system detects";
    }

    /// Returns true if the USB descriptors of a device are those of the protocol. Reading descriptors does not open the
    /// device.
    [[nodiscard]] static bool is_ours(libusb_device* device) noexcept {
        libusb_device_descriptor descriptor{};
        if (libusb_get_device_descriptor(device, &descriptor) != 0 ||
            descriptor.idVendor != wire::vendor_id || descriptor.idProduct != wire::product_id) {
            return false;
        }
        libusb_config_descriptor* read = nullptr;
        if (libusb_get_config_descriptor(device, 0, &read) != 0) {
            return false;
        }
        struct Free {
            void operator()(libusb_config_descriptor* config) const noexcept {
                libusb_free_config_descriptor(config);
            }
        };
        const std::unique_ptr<libusb_config_descriptor, Free> config{read};
        const std::span interfaces{config->interface, config->bNumInterfaces};
        return std::any_of(interfaces.begin(), interfaces.end(), [](const libusb_interface& interface) {
            if (interface.num_altsetting < 1) {
                return false;
            }
            const libusb_interface_descriptor& first = interface.altsetting[0];
            return first.bInterfaceNumber == wire::interface_number &&
                   first.bInterfaceClass == wire::interface_kind[0] &&
                   first.bInterfaceSubClass == wire::interface_kind[1] &&
                   first.bInterfaceProtocol == wire::interface_kind[2];
        });
    }

    /// Opens a USB device, reads its name, checks its properties, and adds it to one of three lists: `suitable`,
    /// `others` (its serial number is not the requested one) or `reasons` (why palpate cannot use it).
    static void examine(libusb_device* device, const std::string& serial, std::vector<Candidate>& suitable,
                        std::vector<std::string>& others, std::vector<std::string>& reasons) {
        UsbName name;
        name.bus = libusb_get_bus_number(device);
        name.address = libusb_get_device_address(device);
        const auto refuse = [&](const std::string& failure, int code) {
            reasons.push_back(name.text() + " " + failure + ": " + usb_reason(code));
        };
        libusb_device_handle* opened = nullptr;
        if (const int code = libusb_open(device, &opened); code != 0) {
            return refuse("cannot be opened", code);
        }
        Handle handle{opened};
        libusb_device_descriptor descriptor{};
        libusb_get_device_descriptor(device, &descriptor);
        name.manufacturer = string_of(opened, descriptor.iManufacturer);
        name.product = string_of(opened, descriptor.iProduct);
        name.serial = string_of(opened, descriptor.iSerialNumber);
        if (!serial.empty() && name.serial != serial) {
            others.push_back(name.serial);
            return;
        }
        if (const int code = libusb_claim_interface(opened, wire::interface_number); code != 0) {
            return refuse("cannot be used", code);
        }
        std::array<std::uint8_t, wire::largest_packet> bytes{};
        const int transferred = read(opened, wire::Request::GetInfo, bytes);
        if (transferred < 0) {
            return refuse("does not report its properties (GET_INFO)", transferred);
        }
        wire::Info info;
        const std::string fault =
            wire::decode(std::span{bytes}.first(static_cast<std::size_t>(transferred)), info);
        if (!fault.empty()) {
            reasons.push_back(name.text() + " is 1209:0001 with another protocol: " + fault);
            return;
        }
        suitable.push_back({std::move(handle), name, info});
    }

    std::unique_ptr<libusb_context, CloseContext> context_;
    Handle handle_;
    UsbName name_;
    wire::Info info_;
};

}  // namespace detail

}  // namespace palpate
