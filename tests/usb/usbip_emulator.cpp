// SPDX-License-Identifier: Apache-2.0
// Runs a command with the emulated device at a virtual host controller (vhci_hcd) of the kernel, so the whole USB stack
// of the host is real. Needs root; for the guest of tests/usb/guest.py:
//
//   usbip_emulator [OPTIONS] -- COMMAND...
//
// The exit code is that of the command.
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <iostream>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include "command.hpp"
#include "emulation.hpp"

namespace emulator {
namespace {

constexpr const char* controller = "/sys/devices/platform/vhci_hcd.0/";

/// Device side of the connection: messages of USB/IP (Documentation/usb/usbip_protocol.rst of the kernel). All fields
/// are 32 bits wide and big endian.
class UsbIp {
  public:
    /// Plugs the emulated device in at full speed; throws if the kernel has no virtual USB controller.
    explicit UsbIp(Port& port) : port_{port} {
        std::array<int, 2> ends{};
        if (::socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()) != 0) {
            throw std::runtime_error("cannot create a pair of sockets");
        }
        wire_ = ends[0];
        std::ofstream attach{std::string(controller) + "attach"};
        attach << "0 " << ends[1] << " " << device_id << " 2"
               << std::flush;  // port number, socket, device number, and 2 for a device at full speed
        ::close(ends[1]);
        if (!attach) {
            throw std::runtime_error("vhci_hcd refuses the device; check that its module is loaded");
        }
    }
    ~UsbIp() { unplug(); }
    UsbIp(const UsbIp&) = delete;
    UsbIp& operator=(const UsbIp&) = delete;

    /// Unplugs the device from the kernel.
    void unplug() {
        if (wire_ >= 0) {
            ::close(std::exchange(wire_, -1));
        }
    }
    [[nodiscard]] int file() const { return wire_; }

    /// Handles a message of the kernel. Returns false if the kernel closed the device.
    [[nodiscard]] bool receive() {
        std::array<std::uint8_t, 48> header{};
        if (!read_all(header.data(), header.size())) {
            return false;
        }
        const auto word = [&](std::size_t at) {
            return static_cast<std::uint32_t>(header.at(at) << 24U | header.at(at + 1) << 16U |
                                              header.at(at + 2) << 8U | header.at(at + 3));
        };
        const std::uint32_t number = word(4);
        if (word(0) == unlink_command) {
            // The status zero in the answer means that the transfer had completed and that its own answer was already
            // sent.
            const bool waited = port_.cancel(word(20), this, 0);
            if (waited) {
                port_.done().pop_back();
            }
            answer(unlink_answer, number, waited ? -ECONNRESET : 0, 0, {});
            return true;
        }
        const bool in = word(12) == 1;
        const std::size_t length = word(24);
        Transfer transfer;
        transfer.id = number;
        transfer.owner = this;
        transfer.is_control = word(16) == 0;
        transfer.endpoint = static_cast<std::uint8_t>(word(16) | (in ? 0x80U : 0U));
        transfer.length = length;
        transfer.setup.assign(header.begin() + 40, header.end());
        if (!in) {
            transfer.data.resize(length);
            if (!read_all(transfer.data.data(), length)) {
                return false;
            }
        }
        if (transfer.is_control && transfer.setup[0] == 0x02 &&
            transfer.setup[1] == 1) {  // CLEAR_FEATURE, endpoint
            port_.clear_halt(transfer.setup[4]);
        }
        if (const int error = port_.submit(std::move(transfer)); error != 0) {
            answer(submit_answer, number, error, 0, {});
        }
        return true;
    }

    /// Sends the answers of all completed transfers to the kernel.
    void answer_all() {
        while (!port_.done().empty()) {
            const Transfer transfer = std::move(port_.done().front());
            port_.done().pop_front();
            const bool in =
                transfer.is_control ? (transfer.setup.at(0) & 0x80U) != 0 : (transfer.endpoint & 0x80U) != 0;
            answer(submit_answer, static_cast<std::uint32_t>(transfer.id), transfer.status, transfer.actual,
                   in && transfer.status == 0 ? transfer.data : Bytes{});
        }
    }

  private:
    static constexpr std::uint32_t unlink_command = 2;
    static constexpr std::uint32_t submit_answer = 3;
    static constexpr std::uint32_t unlink_answer = 4;
    static constexpr std::uint32_t device_id = 1U << 16U | 2U;  // bus and device number that the kernel uses

    bool read_all(std::uint8_t* bytes, std::size_t size) {
        while (size > 0) {
            const ssize_t received = ::read(wire_, bytes, size);
            if (received <= 0 && errno != EINTR) {
                return false;
            }
            bytes += received > 0 ? received : 0;
            size -= static_cast<std::size_t>(received > 0 ? received : 0);
        }
        return true;
    }

    void answer(std::uint32_t command, std::uint32_t number, int status, std::size_t actual,
                const Bytes& data) {
        Bytes message;
        const auto put_word = [&](std::uint32_t value) {
            for (const unsigned shift : {24U, 16U, 8U, 0U}) {
                message.push_back(static_cast<std::uint8_t>(value >> shift));
            }
        };
        put_word(command);
        put_word(number);
        for (int k = 0; k < 3; ++k) {
            put_word(0);
        }
        put_word(static_cast<std::uint32_t>(status));
        put_word(static_cast<std::uint32_t>(actual));
        message.resize(48, 0);
        message.insert(message.end(), data.begin(), data.end());
        if (wire_ >= 0 && ::send(wire_, message.data(), message.size(), MSG_NOSIGNAL) < 0) {
            unplug();
        }
    }

    Port& port_;
    int wire_ = -1;
};

int run(Settings settings) {
    using namespace std::chrono_literals;
    const Identity identity = settings.devices.empty() ? Identity{} : settings.devices.front();
    Port port{make_device(settings, identity, settings.script)};
    FrameClock clock{settings.rate_hz};
    std::ofstream trace;
    if (!settings.trace.empty()) {
        trace.open(settings.trace);
        trace << EmulatedDevice::trace_header();
    }
    std::mutex mutex;
    const Orders orders{[&](const std::string& order) {
        const std::lock_guard locked{mutex};
        return execute_order(port, order);
    }};
    std::atomic<bool> over{false};
    std::thread bus{[&] {
        UsbIp usb{port};
        while (!over && usb.file() >= 0) {
            auto until = FrameClock::Clock::now() + 50ms;
            {
                const std::lock_guard locked{mutex};
                while (clock.is_due(port.device().is_slow(), FrameClock::Clock::now(), until)) {
                    port.frame();
                    usb.answer_all();
                    if (trace.is_open()) {
                        trace << port.device().trace_row();
                    }
                    if (port.device().is_unplugged()) {
                        return;
                    }
                }
            }
            const auto left = until - FrameClock::Clock::now();
            const auto whole = std::chrono::duration_cast<std::chrono::seconds>(left);
            const timespec wait{whole.count(),
                                std::max<long>(0, std::chrono::nanoseconds(left - whole).count())};
            pollfd ready{usb.file(), POLLIN, 0};
            if (::ppoll(&ready, 1, &wait, nullptr) > 0) {
                const std::lock_guard locked{mutex};
                if (!usb.receive()) {
                    return;
                }
                usb.answer_all();
            }
        }
    }};
    std::this_thread::sleep_for(1s);  // enumeration
    Command command{settings.command, {orders.variable()}, [] {}};
    const int code = command.wait();
    over = true;
    bus.join();
    if (trace.is_open()) {
        trace << port.device().trace_row();  // state of the emulated device after the command has ended
    }
    return code;
}

}  // namespace
}  // namespace emulator

int main(int count, char** words) {
    try {
        emulator::Settings settings = emulator::read_settings(count, words);
        if (settings.command.empty()) {
            std::cerr << "Usage: usbip_emulator [OPTIONS] -- COMMAND...\n\n" << emulator::options_text;
            return 2;
        }
        return emulator::run(std::move(settings));
    } catch (const std::exception& error) {
        std::cerr << "usbip_emulator: " << error.what() << "\n";
        return 2;
    }
}
