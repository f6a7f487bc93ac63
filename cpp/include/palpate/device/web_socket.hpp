// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "palpate/realtime/periodic.hpp"

namespace palpate {

/// Reads the frames of a WebSocket server (RFC 6455, section 5) from bytes that arrive in pieces of any length.
class WebSocketFrames {
  public:
    enum class Found : std::uint8_t {
        Nothing,  ///< no complete frame
        Message,
        Ping,
        Close,
        Error,  ///< bytes that RFC 6455 forbids, or a message that is too long; every later result is Error as well
    };
    /// Longest message with all its fragments; the messages of a device have some kilobytes [bytes]
    static constexpr std::size_t max_message = std::size_t{1} << 20U;

    void add(std::string_view bytes) { bytes_ += bytes; }

    /// Takes frames up to the end of the next message, ping or close frame, and sets `content` to its bytes. The reader of
    /// a message checks that it is UTF-8.
    [[nodiscard]] Found next(std::string& content) {
        while (bytes_.size() >= 2) {
            const bool is_last = (byte(0) & 0x80U) != 0;
            const std::size_t opcode = byte(0) & 0x0fU;
            const bool is_control = opcode >= closing;
            std::size_t length = byte(1) & 0x7fU;
            const std::size_t head = length < 126 ? 2 : length == 126 ? 4 : 10;
            if (bytes_.size() < head) {
                return Found::Nothing;
            }
            for (std::size_t k = 2; k < head; ++k) {
                length = (k == 2 ? 0 : length << 8U) | byte(k);
            }
            const bool is_reserved = (byte(0) & 0x70U) != 0 || opcode > pong || (opcode > 2 && !is_control);
            const bool is_masked = byte(1) >= 0x80U;
            const bool is_misplaced = is_control ? !is_last : is_begun_ != (opcode == 0);
            const bool has_shorter_form = (head == 4 && length < 126) || (head == 10 && length < 65536);
            if (is_reserved || is_masked || is_misplaced || has_shorter_form ||
                length > (is_control ? 125 : max_message - message_.size())) {
                return Found::Error;
            }
            if (bytes_.size() - head < length) {
                return Found::Nothing;
            }
            if (is_control) {
                content.clear();
            }
            (is_control ? content : message_).append(bytes_, head, length);
            bytes_.erase(0, head + length);
            if (is_control && opcode != pong) {
                return opcode == closing ? Found::Close : Found::Ping;
            }
            is_begun_ = is_control ? is_begun_ : !is_last;
            if (!is_control && is_last) {
                content = std::exchange(message_, {});
                return Found::Message;
            }
        }
        return Found::Nothing;
    }

  private:
    static constexpr std::size_t closing = 8;
    static constexpr std::size_t pong = 10;

    [[nodiscard]] std::size_t byte(std::size_t place) const {
        return static_cast<unsigned char>(bytes_[place]);
    }

    std::string bytes_;      ///< received, and not part of a frame that was taken
    std::string message_;    ///< fragments of a message whose last one has not arrived
    bool is_begun_ = false;  ///< true between the first and the last fragment of a message
};

/// Connection to a WebSocket server (RFC 6455) on this computer. Each function that waits has a deadline.
///
/// The key of the handshake and the masks of the frames are constants: random ones protect proxies from web pages that
/// choose the sent bytes, and there is neither here. The answer to the key still proves that the server speaks WebSocket.
class WebSocket {
  public:
    WebSocket() = default;
    WebSocket(const WebSocket&) = delete;
    WebSocket& operator=(const WebSocket&) = delete;
    ~WebSocket() { disconnect(); }

    /// Connects to a numeric address, once. Returns "", or the reason for which there is no connection.
    [[nodiscard]] std::string open(const std::string& host, std::uint16_t port, Nanoseconds until) {
        std::string reason = connect(host, std::to_string(port), until);
        if (reason.empty()) {
            reason = shake_hands(host + ":" + std::to_string(port), until);
        }
        if (!reason.empty()) {
            disconnect();
        }
        return reason;
    }

    [[nodiscard]] bool is_open() const noexcept { return socket_ >= 0; }

    /// Sends a message. A message that cannot be sent before the deadline ends the connection.
    void send(std::string_view message, Nanoseconds until) { send_frame(0x81, message, until); }

    /// Receives the next message, and answers pings. Returns false without a message: the deadline has passed, or the
    /// connection has ended.
    [[nodiscard]] bool receive(std::string& message, Nanoseconds until) {
        using Found = WebSocketFrames::Found;
        for (bool is_late = false; is_open();) {
            const Found found = frames_.next(content_);
            if (found == Found::Message) {
                message.swap(content_);
                return true;
            }
            if (found == Found::Ping) {
                send_frame(0x8a, content_, until);
            } else if (found == Found::Close) {
                end("\x03\xe8", until);
            } else if (found == Found::Error) {
                end("\x03\xea", until);
            } else if (is_late || !receive_bytes(until)) {
                return false;
            } else {
                frames_.add({part_.data(), received_});
                is_late = monotonic_now() >= until;  // bytes that never make a message do not extend the wait
            }
        }
        return false;
    }

    /// Closes the connection. Waits until the server has ended it.
    void close(Nanoseconds until) { end("\x03\xe8", until); }

  private:
    [[nodiscard]] std::string connect(const std::string& host, const std::string& port, Nanoseconds until) {
        addrinfo wanted{};
        wanted.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV;
        wanted.ai_socktype = SOCK_STREAM;
        addrinfo* address = nullptr;
        if (::getaddrinfo(host.c_str(), port.c_str(), &wanted, &address) != 0) {
            return "'" + host + "' is not an address";
        }
        socket_ = ::socket(address->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
        int error = ::connect(socket_, address->ai_addr, address->ai_addrlen) == 0 ? 0 : errno;
        ::freeaddrinfo(address);
        if (error == EINPROGRESS) {
            if (!is_ready(POLLOUT, until)) {
                return "no answer";
            }
            socklen_t size = sizeof error;
            (void)::getsockopt(socket_, SOL_SOCKET, SO_ERROR, &error, &size);
        }
        const int on = 1;
        (void)::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
        return error == 0 ? "" : std::generic_category().message(error);
    }

    [[nodiscard]] std::string shake_hands(const std::string& service, Nanoseconds until) {
        send_bytes("GET / HTTP/1.1\r\nHost: " + service +
                       "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13"
                       "\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n",
                   until);
        std::string answer;
        std::size_t end = std::string::npos;
        while (end == std::string::npos) {
            if (answer.size() > WebSocketFrames::max_message || monotonic_now() >= until ||
                !receive_bytes(until)) {
                return "no answer";
            }
            answer.append(part_.data(), received_);
            end = answer.find("\r\n\r\n");
        }
        frames_.add(std::string_view{answer}.substr(end + 4));
        return is_accepted(answer.substr(0, end + 2)) ? "" : "the program there is no WebSocket server";
    }

    /// Returns true if the lines of an answer accept the handshake; blanks and upper case are not compared.
    [[nodiscard]] static bool is_accepted(std::string answer) {
        std::erase_if(answer, [](char each) { return each == ' ' || each == '\t'; });
        std::transform(answer.begin(), answer.end(), answer.begin(),
                       [](unsigned char each) { return static_cast<char>(std::tolower(each)); });
        return answer.starts_with("http/1.1101") &&
               answer.find("\r\nsec-websocket-accept:s3pplmbitxaq9kygzzhzrbk+xoo=\r\n") != std::string::npos;
    }

    /// Waits for an event of the socket. Returns false if the deadline passes before.
    [[nodiscard]] bool is_ready(short event, Nanoseconds until) const {
        pollfd file{socket_, event, 0};
        int ready = 0;
        for (bool is_late = false; ready <= 0 && !is_late; is_late = monotonic_now() >= until) {
            const Nanoseconds left = std::max<Nanoseconds>(until - monotonic_now(), 0);
            ready = ::poll(&file, 1, static_cast<int>((left + 999'999) / 1'000'000));
        }
        return ready > 0;
    }

    void send_frame(unsigned char head, std::string_view content, Nanoseconds until) {
        const std::size_t size = content.size();
        const int places = size < 126 ? 0 : size < 65536 ? 2 : 8;
        frame_ = static_cast<char>(head);
        frame_ += static_cast<char>(0x80U | (places == 0 ? size : places == 2 ? 126 : 127));
        for (int k = places; k-- > 0;) {
            frame_ += static_cast<char>(size >> 8U * static_cast<unsigned>(k));
        }
        frame_.append(4, '\0');  // the mask: exclusive or with 0 leaves the content as it is
        frame_ += content;
        send_bytes(frame_, until);
    }

    void send_bytes(std::string_view bytes, Nanoseconds until) {
        while (is_open() && !bytes.empty()) {
            const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
            if (sent >= 0) {
                bytes.remove_prefix(static_cast<std::size_t>(sent));
            } else if (errno != EAGAIN || !is_ready(POLLOUT, until)) {
                disconnect();
            }
        }
    }

    /// Receives at least one byte into `part_`. Returns false if the deadline passes before, or at the end of the
    /// connection.
    [[nodiscard]] bool receive_bytes(Nanoseconds until) {
        while (is_open()) {
            const ssize_t size = ::recv(socket_, part_.data(), part_.size(), 0);
            if (size > 0) {
                received_ = static_cast<std::size_t>(size);
                return true;
            }
            if (size == 0 || errno != EAGAIN) {
                disconnect();
            } else if (!is_ready(POLLIN, until)) {
                return false;
            }
        }
        return false;
    }

    /// Sends a close frame with this status, and waits for the end of the connection, which a server must end.
    void end(std::string_view status, Nanoseconds until) {
        send_frame(0x88, status, until);
        while (receive_bytes(until) && monotonic_now() < until) {
        }
        disconnect();
    }

    void disconnect() noexcept {
        if (is_open()) {
            ::close(std::exchange(socket_, -1));
        }
    }

    int socket_ = -1;
    WebSocketFrames frames_;
    std::string content_;             ///< content of the frame that was read last
    std::string frame_;               ///< frame that was sent last
    std::array<char, 16384> part_{};  ///< bytes that were received last
    std::size_t received_ = 0;        ///< number of these bytes
};

}  // namespace palpate
