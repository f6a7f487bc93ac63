// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>

#include "palpate/device/detail/packet_socket.hpp"
#include "palpate/device/device.hpp"
#include "palpate/realtime/periodic.hpp"

namespace palpate {

/// Flag in canfd_frame::flags of a frame of CAN FD; CANFD_FDF of newer headers.
inline constexpr std::uint8_t fd_frame_flag = 0x04;

/// Result of sending a frame.
enum class Sent : std::uint8_t {
    Yes,
    Full,  ///< the queue of the interface is full: no node confirms frames
    Down,  ///< the interface is down or gone
};

/// A CAN bus over SocketCAN of Linux (docs.kernel.org/networking/can.html), for frames of CAN and CAN FD.
///
/// A name with a slash is the path of a Unix socket (SOCK_SEQPACKET) that carries the same frames, so that an emulated
/// drive needs no CAN hardware.
class CanBus {
  public:
    CanBus() = default;
    CanBus(CanBus&& other) noexcept
        : socket_{std::exchange(other.socket_, -1)}, is_off_{std::exchange(other.is_off_, false)} {}
    CanBus& operator=(CanBus&&) = delete;
    ~CanBus() { close(); }

    /// Opens the interface, for example can0.
    Opened open(const std::string& name) {
        close();
        is_off_ = false;
        const bool is_path = name.find('/') != std::string::npos;
        std::string reason = is_path ? detail::connect_to_emulator(name, socket_) : open_interface(name);
        if (!reason.empty()) {
            close();
        }
        return {reason};
    }

    void close() noexcept {
        if (socket_ >= 0) {
            ::close(std::exchange(socket_, -1));
        }
    }

    /// Sends a frame without waiting.
    [[nodiscard]] Sent send(const canfd_frame& frame) noexcept {
        if (socket_ < 0 || is_off_) {
            return Sent::Down;
        }
        canfd_frame sent = frame;
        sent.flags &= static_cast<std::uint8_t>(~fd_frame_flag);
        const std::size_t size = (frame.flags & fd_frame_flag) != 0 ? CANFD_MTU : CAN_MTU;
        const ssize_t done = ::send(socket_, &sent, size, MSG_DONTWAIT | MSG_NOSIGNAL);
        if (done < 0) {
            return errno == ENOBUFS || errno == EAGAIN ? Sent::Full : Sent::Down;
        }
        return done == static_cast<ssize_t>(size) ? Sent::Yes : Sent::Down;
    }

    /// Receives the next data frame that arrives before the deadline. Returns false without one.
    [[nodiscard]] bool receive(canfd_frame& frame, Nanoseconds deadline) noexcept {
        while (socket_ >= 0 && !is_off_) {
            const ssize_t size = ::recv(socket_, &frame, sizeof frame, MSG_DONTWAIT);
            if (size == CAN_MTU || size == CANFD_MTU) {
                if ((frame.can_id & CAN_ERR_FLAG) == 0) {
                    return true;
                }
                is_off_ = (frame.can_id & CAN_ERR_BUSOFF) != 0;
                continue;
            }
            if (size >= 0 || (errno != EAGAIN && errno != EINTR)) {
                is_off_ = true;  // a closed socket, or an interface that is down
                return false;
            }
            if (!detail::wait_to_read(socket_, deadline)) {
                return false;
            }
        }
        return false;
    }

    /// Returns true after the controller left the bus, or the interface went down.
    [[nodiscard]] bool is_off() const noexcept { return is_off_; }

  private:
    [[nodiscard]] static std::string failure(const std::string& name, const std::string& cure) {
        return name + ": " + std::generic_category().message(errno) + "; " + cure;
    }

    [[nodiscard]] std::string open_interface(const std::string& name) {
        const unsigned index = ::if_nametoindex(name.c_str());
        if (index == 0) {
            return "there is no CAN interface " + name +
                   ": 'ip link' lists the interfaces, and 'ip link set " + name +
                   " up type can bitrate 1000000' starts one";
        }
        socket_ = ::socket(AF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
        if (socket_ < 0) {
            return failure(name, "load the kernel module can_raw");
        }
        const int on = 1;
        (void)::setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on);
        const can_err_mask_t errors = CAN_ERR_BUSOFF;
        (void)::setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors);
        sockaddr_can address{};
        address.can_family = AF_CAN;
        address.can_ifindex = static_cast<int>(index);
        if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
            return failure(name, "start it with 'ip link set " + name + " up'");
        }
        return "";
    }

    int socket_ = -1;
    bool is_off_ = false;
};

}  // namespace palpate
