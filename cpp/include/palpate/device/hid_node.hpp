// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <linux/hidraw.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "palpate/device/detail/packet_socket.hpp"
#include "palpate/device/device.hpp"
#include "palpate/realtime/periodic.hpp"

namespace palpate::hid {

/// Result of sending a report.
enum class Written : std::uint8_t {
    Yes,
    Busy,  ///< the device does not take a report now
    Gone,  ///< the device is gone
};

/// Result of waiting for a report.
enum class Received : std::uint8_t { None, Report, Gone };

/// A node of hidraw of Linux (docs.kernel.org/hid/hidraw.html). Each report begins with the byte of its number.
///
/// A Unix socket (SOCK_SEQPACKET) in place of the node carries the same reports, so that an emulated device needs no
/// hardware. Each message begins with a letter: D the report descriptor, F a feature report to the device, G one from
/// it, O an output report, I an input report. D, F and G are answered by a message with the same letter; F by one byte,
/// 0 for success.
class Node {
  public:
    Node() = default;
    Node(Node&& other) noexcept
        : file_{std::exchange(other.file_, -1)},
          is_socket_{other.is_socket_},
          descriptor_{std::move(other.descriptor_)},
          message_{std::move(other.message_)} {}
    Node& operator=(Node&&) = delete;
    ~Node() { close(); }

    /// Opens the node, locks it against other programs that do the same, and reads the report descriptor.
    Opened open(const std::string& path) {
        close();
        struct stat info{};
        is_socket_ = ::stat(path.c_str(), &info) == 0 && S_ISSOCK(info.st_mode);
        std::string reason = is_socket_ ? palpate::detail::connect_to_emulator(path, file_) : open_file(path);
        if (reason.empty() && !read_descriptor()) {
            reason = path + ": " + std::generic_category().message(errno) +
                     "; choose the hidraw node of a wheel, 'ls /dev/hidraw*' lists the nodes";
        }
        if (!reason.empty()) {
            close();
        }
        return {reason};
    }

    void close() noexcept {
        if (file_ >= 0) {
            ::close(std::exchange(file_, -1));
        }
    }

    [[nodiscard]] const std::vector<std::uint8_t>& descriptor() const noexcept { return descriptor_; }

    /// Sends an output report. The kernel returns when the device has taken it, a millisecond at full speed.
    [[nodiscard]] Written write(std::span<const std::uint8_t> report) noexcept { return send('O', report); }

    /// Receives the next input report that arrives before the deadline. `size` is that of the report, at most that of
    /// the buffer.
    [[nodiscard]] Received receive(std::span<std::uint8_t> report, std::size_t& size,
                                   Nanoseconds deadline) noexcept {
        while (file_ >= 0) {
            const ssize_t got = is_socket_ ? ::recv(file_, message_.data(), message_.size(), MSG_DONTWAIT)
                                           : ::read(file_, report.data(), report.size());
            if (got > 0 && !is_socket_) {
                size = static_cast<std::size_t>(got);
                return Received::Report;
            }
            if (got > 0 && message_[0] == 'I') {
                size = std::min(static_cast<std::size_t>(got) - 1, report.size());
                std::copy_n(message_.begin() + 1, size, report.begin());
                return Received::Report;
            }
            if (got > 0) {
                continue;  // an answer that came too late
            }
            if (got == 0 || (errno != EAGAIN && errno != EINTR)) {
                return Received::Gone;
            }
            if (!palpate::detail::wait_to_read(file_, deadline)) {
                return Received::None;
            }
        }
        return Received::Gone;
    }

    /// Sends a feature report. Returns false if the device refuses it.
    [[nodiscard]] bool set_feature(std::span<const std::uint8_t> report) noexcept {
        if (!is_socket_) {
            std::vector<std::uint8_t> copy{report.begin(), report.end()};
            return ::ioctl(file_, HIDIOCSFEATURE(copy.size()), copy.data()) >= 0;
        }
        return request('F', report) == 2 && message_[1] == 0;
    }

    /// Reads the feature report with the number in the first byte of `report`. Returns false if the device sends none,
    /// or one of another size.
    [[nodiscard]] bool get_feature(std::span<std::uint8_t> report) noexcept {
        if (!is_socket_) {
            return ::ioctl(file_, HIDIOCGFEATURE(report.size()), report.data()) ==
                   static_cast<int>(report.size());
        }
        if (request('G', report.first(1)) != report.size() + 1) {
            return false;
        }
        std::copy_n(message_.begin() + 1, report.size(), report.begin());
        return true;
    }

  private:
    static constexpr Nanoseconds answer_wait = 500'000'000;  ///< longest wait for an emulated device [ns]

    [[nodiscard]] std::string open_file(const std::string& path) {
        file_ = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
        if (file_ < 0) {
            const char* cure = errno == EACCES
                                   ? "; allow your user to open it with a udev rule for SUBSYSTEM==\"hidraw\""
                                   : "; 'ls /dev/hidraw*' lists the nodes";
            return path + ": " + std::generic_category().message(errno) + cure;
        }
        if (::flock(file_, LOCK_EX | LOCK_NB) != 0) {
            return path + " is used by another program: end that program first";
        }
        return "";
    }

    [[nodiscard]] bool read_descriptor() {
        message_.resize(1 + HID_MAX_DESCRIPTOR_SIZE);
        if (is_socket_) {
            const std::size_t size = request('D', {});
            descriptor_.assign(message_.begin() + 1, message_.begin() + static_cast<std::ptrdiff_t>(
                                                                            std::max<std::size_t>(size, 1)));
            return size > 0;
        }
        hidraw_report_descriptor stored{};
        int size = 0;
        if (::ioctl(file_, HIDIOCGRDESCSIZE, &size) < 0) {
            return false;
        }
        stored.size = static_cast<std::uint32_t>(std::clamp(size, 0, HID_MAX_DESCRIPTOR_SIZE));
        if (::ioctl(file_, HIDIOCGRDESC, &stored) < 0) {
            return false;
        }
        descriptor_.assign(stored.value, stored.value + stored.size);
        return true;
    }

    /// Sends a report; to an emulated device behind its letter.
    [[nodiscard]] Written send(char letter, std::span<const std::uint8_t> report) noexcept {
        if (file_ < 0) {
            return Written::Gone;
        }
        ssize_t done = 0;
        if (is_socket_) {
            message_[0] = static_cast<std::uint8_t>(letter);
            std::copy(report.begin(), report.end(), message_.begin() + 1);
            done = ::send(file_, message_.data(), report.size() + 1, MSG_DONTWAIT | MSG_NOSIGNAL) - 1;
        } else {
            done = ::write(file_, report.data(), report.size());
        }
        if (done == static_cast<ssize_t>(report.size())) {
            return Written::Yes;
        }
        return done < 0 && (errno == EAGAIN || errno == EINTR) ? Written::Busy : Written::Gone;
    }

    /// Sends a message to an emulated device and waits for the answer with the same letter, which is then `message_`.
    /// Returns its size, 0 without an answer.
    [[nodiscard]] std::size_t request(char letter, std::span<const std::uint8_t> content) noexcept {
        if (send(letter, content) != Written::Yes) {
            return 0;
        }
        for (const Nanoseconds deadline = monotonic_now() + answer_wait;
             palpate::detail::wait_to_read(file_, deadline);) {
            const ssize_t got = ::recv(file_, message_.data(), message_.size(), MSG_DONTWAIT);
            if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) {
                return 0;
            }
            if (got > 0 && message_[0] == static_cast<std::uint8_t>(letter)) {
                return static_cast<std::size_t>(got);
            }
        }
        return 0;
    }

    int file_ = -1;
    bool is_socket_ = false;
    std::vector<std::uint8_t> descriptor_;
    std::vector<std::uint8_t> message_;  ///< message to or from an emulated device
};

}  // namespace palpate::hid
