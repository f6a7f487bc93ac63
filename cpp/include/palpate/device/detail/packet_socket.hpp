// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <cerrno>
#include <string>
#include <system_error>

#include "palpate/realtime/periodic.hpp"

namespace palpate::detail {

/// Connects a file to a Unix socket (SOCK_SEQPACKET), on which an emulated device answers. Returns "", or the reason
/// with the cure; the caller closes the file.
[[nodiscard]] inline std::string connect_to_emulator(const std::string& path, int& file) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.size() >= sizeof address.sun_path) {
        return "the path of the socket " + path + " is too long: use a shorter one";
    }
    std::copy(path.begin(), path.end(), static_cast<char*>(address.sun_path));
    file = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
    if (file < 0 || ::connect(file, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
        return path + ": " + std::generic_category().message(errno) + "; start the emulated device first";
    }
    return "";
}

/// Waits until a file can be read, or until the deadline. Returns false if the deadline has passed before.
[[nodiscard]] inline bool wait_to_read(int file, Nanoseconds deadline) noexcept {
    const Nanoseconds left = deadline - monotonic_now();
    if (left <= 0) {
        return false;
    }
    pollfd wait{file, POLLIN, 0};
    const timespec time{left / nanoseconds_a_second, left % nanoseconds_a_second};
    (void)::ppoll(&wait, 1, &time, nullptr);
    return true;
}

}  // namespace palpate::detail
