// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <sys/stat.h>
#include <umockdev.h>
#include <unistd.h>

#include <stdexcept>
#include <string>

#include "identity.hpp"
#include "little_endian.hpp"

namespace emulator {

/// Files of a device in a umockdev testbed: its folder in /sys, and its node in /dev/bus/usb with a handler of ioctls.
///
/// umockdev forwards ioctls but not poll(). The node is therefore a FIFO for one byte, because libusb waits until it is
/// writable. It is empty if a transfer can be reaped, otherwise full.
class UsbfsFiles {
  public:
    UsbfsFiles(UMockdevTestbed* testbed, UMockdevIoctlBase* handler, const Identity& identity, int address)
        : testbed_{testbed},
          name_{"1-" + std::to_string(address)},
          system_path_{"/sys/devices/usb1/" + name_},
          node_{"/dev/bus/usb/001/" + three_digits(address)} {
        GError* error = nullptr;
        if (umockdev_testbed_attach_ioctl(testbed_, node_.c_str(), handler, &error) == FALSE) {
            throw std::runtime_error(std::string("umockdev: ") + error->message);
        }
        if (umockdev_testbed_add_from_string(testbed_, description(identity, address).c_str(), &error) ==
            FALSE) {
            throw std::runtime_error(std::string("umockdev: ") + error->message);
        }
        make_fifo();
    }
    UsbfsFiles(const UsbfsFiles&) = delete;
    UsbfsFiles& operator=(const UsbfsFiles&) = delete;

    /// Returns the real path of the file that represents the USB device.
    [[nodiscard]] const std::string& node_file() const { return node_file_; }

    /// Makes the device file writable if `ready` is true: a completed transfer then waits for the host.
    void show(bool ready) {
        if (ready == shown_ready_) {
            return;
        }
        shown_ready_ = ready;
        char byte = 0;
        const ssize_t moved = ready ? ::read(fifo_, &byte, 1) : ::write(fifo_, &byte, 1);
        if (moved != 1) {
            throw std::runtime_error("the FIFO of the device node failed");
        }
    }

    void announce_removal() {
        umockdev_testbed_uevent(testbed_, system_path_.c_str(), "remove");
        umockdev_testbed_remove_device(testbed_, system_path_.c_str());
    }
    void announce_arrival() { umockdev_testbed_uevent(testbed_, system_path_.c_str(), "add"); }

  private:
    static std::string three_digits(int number) { return std::to_string(1000 + number).substr(1); }

    static std::string hex(const Bytes& bytes) {
        constexpr const char* digits = "0123456789abcdef";
        std::string text;
        for (const std::uint8_t byte : bytes) {
            text += digits[byte >> 4U];
            text += digits[byte & 15U];
        }
        return text;
    }

    /// Replaces each character outside printable ASCII by '?', which is sufficient because the library does not read
    /// the device's names from /sys.
    static std::string ascii(const std::u16string& text) {
        std::string letters;
        for (const char16_t unit : text) {
            letters += unit >= 0x20 && unit < 0x7F ? static_cast<char>(unit) : '?';
        }
        return letters;
    }

    /// Returns the description of the USB device in the format of umockdev.
    [[nodiscard]] std::string description(const Identity& identity, int address) const {
        const Bytes configuration = identity.configuration_descriptor();
        Bytes descriptors = identity.device_descriptor();
        descriptors.insert(descriptors.end(), configuration.begin(), configuration.end());
        const auto attribute = [](const char* name, const std::string& value) {
            return std::string("A: ") + name + "=" + value + "\\n\n";
        };
        return "P: /devices/usb1/" + name_ + "\nN: " + node_.substr(5) +
               "\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nE: DRIVER=usb\nE: BUSNUM=001\nE: DEVNUM=" +
               three_digits(address) + "\nE: DEVNAME=" + node_ +
               "\nE: PRODUCT=1209/1/100\nE: TYPE=255/0/0\n" +
               attribute("bConfigurationValue", std::to_string(identity.configuration)) +
               attribute("busnum", "1") + attribute("devnum", std::to_string(address)) +
               attribute("speed", "12") + attribute("idVendor", "1209") + attribute("idProduct", "0001") +
               attribute("serial", ascii(identity.serial)) + attribute("product", ascii(identity.product)) +
               attribute("manufacturer", ascii(identity.manufacturer)) +
               "H: descriptors=" + hex(descriptors) + "\n\n";
    }

    void make_fifo() {
        gchar* root = umockdev_testbed_get_root_dir(testbed_);
        node_file_ = std::string(root) + node_;
        g_free(root);
        ::unlink(node_file_.c_str());
        if (::mkfifo(node_file_.c_str(), 0666) != 0) {
            throw std::runtime_error("cannot create a FIFO at " + node_file_);
        }
        ::chmod(node_file_.c_str(), 0666);
        fifo_ = ::open(node_file_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
        ::fcntl(fifo_, F_SETPIPE_SZ, 4096);
        show(false);
    }

    UMockdevTestbed* testbed_;
    std::string name_;
    std::string system_path_;
    std::string node_;
    std::string node_file_;
    int fifo_ = -1;
    bool shown_ready_ = true;  ///< an empty FIFO
};

}  // namespace emulator
