// SPDX-License-Identifier: Apache-2.0
#include "palpate/device/web_socket.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <future>
#include <string>
#include <string_view>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "support.hpp"

namespace {

/// Time by which a test has moved the monotonic clock of this program [s]
constinit std::atomic<std::int64_t> moved_s{0};

}  // namespace

/// Replaces the clock of the system.
extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
    const int code = static_cast<int>(::syscall(SYS_clock_gettime, clock, time));
    time->tv_sec += clock == CLOCK_MONOTONIC ? moved_s.load() : 0;
    return code;
}

namespace palpate {
namespace {

using Found = WebSocketFrames::Found;
using namespace std::chrono_literals;

constexpr unsigned char text = 0x81;
constexpr unsigned char first_part = 0x01;
constexpr unsigned char middle_part = 0x00;
constexpr unsigned char last_part = 0x80;
constexpr unsigned char closing = 0x88;
constexpr unsigned char ping = 0x89;
constexpr unsigned char pong = 0x8a;

/// Returns a frame whose length has this many bytes after the first; -1: the shortest form.
std::string frame(unsigned char head, std::string_view content, int places = -1) {
    const std::size_t size = content.size();
    places = places >= 0 ? places : size < 126 ? 0 : size < 65536 ? 2 : 8;
    std::string bytes{static_cast<char>(head)};
    bytes += static_cast<char>(places == 0 ? size : places == 2 ? 126 : 127);
    for (int k = places - 1; k >= 0; --k) {
        bytes += static_cast<char>(size >> (8 * k));
    }
    return bytes.append(content);
}

/// Kind and content of each frame that is found.
using Read = std::vector<std::pair<Found, std::string>>;

/// Reads what the bytes contain, until the first error.
Read read(WebSocketFrames& frames, std::string_view bytes) {
    Read read;
    frames.add(bytes);
    std::string content;
    for (Found found = frames.next(content); found != Found::Nothing; found = frames.next(content)) {
        read.emplace_back(found, found == Found::Error ? "" : content);
        if (found == Found::Error) {
            break;
        }
    }
    return read;
}

Read read(std::string_view bytes) {
    WebSocketFrames frames;
    return read(frames, bytes);
}

TEST(WebSocketFrames, MessagesOfEachFormOfTheLengthAreRead) {
    for (const std::size_t size : {0U, 1U, 125U, 126U, 127U, 65535U, 65536U, 1U << 20U}) {
        const std::string message(size, 'm');
        EXPECT_EQ(read(frame(text, message)), (Read{{Found::Message, message}})) << size;
    }
    EXPECT_EQ(read(frame(0x82, {"\0b", 2})), (Read{{Found::Message, {"\0b", 2}}})) << "a binary message";
}

TEST(WebSocketFrames, BytesInTwoPiecesGiveTheSameMessagesAsInOne) {
    const std::string bytes = frame(text, "one") + frame(first_part, "tw") + frame(ping, "?") +
                              frame(middle_part, "") + frame(pong, "unasked") + frame(last_part, "o") +
                              frame(text, std::string(126, 'l')) + frame(closing, {"\x03\xe8", 2});
    const Read expected{{Found::Message, "one"},
                        {Found::Ping, "?"},
                        {Found::Message, "two"},
                        {Found::Message, std::string(126, 'l')},
                        {Found::Close, {"\x03\xe8", 2}}};
    for (std::size_t k = 0; k <= bytes.size(); ++k) {
        WebSocketFrames frames;
        Read found = read(frames, bytes.substr(0, k));
        const Read rest = read(frames, bytes.substr(k));
        found.insert(found.end(), rest.begin(), rest.end());
        ASSERT_EQ(found, expected) << "split at byte " << k;
    }
    WebSocketFrames frames;
    Read found;
    for (const char byte : bytes) {
        const Read next = read(frames, {&byte, 1});
        found.insert(found.end(), next.begin(), next.end());
    }
    EXPECT_EQ(found, expected) << "split at every byte";
}

TEST(WebSocketFrames, FramesThatTheStandardForbidsAreErrors) {
    const std::string long_text(126, 'l');
    const std::string first = frame(first_part, "a");
    for (const auto& [name, bytes] : std::vector<std::pair<const char*, std::string>>{
             {"masked", {"\x81\x81\0\0\0\0m", 7}},
             {"reserved bit 1", frame(0xc1, "m")},
             {"reserved bit 2", frame(0xa1, "m")},
             {"reserved bit 3", frame(0x91, "m")},
             {"unknown data frame", frame(0x83, "m")},
             {"unknown data frame", frame(0x87, "m")},
             {"unknown control frame", frame(0x8b, "m")},
             {"unknown control frame", frame(0x8f, "m")},
             {"ping in parts", frame(0x09, "m")},
             {"long ping", frame(ping, long_text)},
             {"long close", frame(closing, long_text)},
             {"16-bit length below 126", frame(text, "m", 2)},
             {"64-bit length below 65536", frame(text, long_text, 8)},
             {"64-bit length with the first bit", {"\x81\x7f\xff\xff\xff\xff\xff\xff\xff\xff", 10}},
             {"last part without a first one", frame(last_part, "m")},
             {"message within a message", first + frame(text, "m")},
             {"message in parts within a message", first + first}}) {
        EXPECT_EQ(read(bytes), (Read{{Found::Error, ""}})) << name;
        EXPECT_EQ(read(bytes + frame(text, "m")), (Read{{Found::Error, ""}})) << name << " and a message";
    }
}

TEST(WebSocketFrames, AMessageOverTheBoundIsAnErrorBeforeItArrives) {
    const std::string longest(WebSocketFrames::max_message, 'm');
    EXPECT_EQ(read(frame(text, longest + 'm').substr(0, 10)), (Read{{Found::Error, ""}}));
    WebSocketFrames frames;
    EXPECT_EQ(read(frames, frame(first_part, longest) + frame(ping, "?") + frame(middle_part, "")),
              (Read{{Found::Ping, "?"}}));
    EXPECT_EQ(read(frames, frame(last_part, "m")), (Read{{Found::Error, ""}})) << "all parts together";
}

/// A connection that the tested client has opened, on the side of the server.
class Client {
  public:
    explicit Client(int socket) : socket_{socket} {}

    /// Sends bytes; returns false if the client has ended the connection.
    bool send(std::string_view bytes) const {
        while (!bytes.empty()) {
            const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
            if (sent <= 0) {
                return false;
            }
            bytes.remove_prefix(static_cast<std::size_t>(sent));
        }
        return true;
    }
    /// Returns the next bytes of the client; fewer at the end of the connection.
    [[nodiscard]] std::string received(std::size_t size) const {
        std::string bytes(size, '\0');
        const ssize_t got = size > 0 ? ::recv(socket_, bytes.data(), size, MSG_WAITALL) : 0;
        bytes.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
        return bytes;
    }
    [[nodiscard]] std::string received_until(std::string_view end) const {
        std::string bytes;
        while (!bytes.ends_with(end)) {
            const std::string next = received(1);
            if (next.empty()) {
                break;
            }
            bytes += next;
        }
        return bytes;
    }
    /// Waits for the end of the connection, which is an error of the network if the client has not read all bytes.
    [[nodiscard]] bool leaves_bytes_unread() const {
        ssize_t got = 1;
        for (char byte = 0; got > 0;) {
            got = ::recv(socket_, &byte, 1, 0);
        }
        return got < 0;
    }
    /// Returns head and content of the client's next frame, which must be masked.
    [[nodiscard]] std::pair<unsigned, std::string> received_frame() const {
        const std::string head = received(2);
        if (head.size() < 2) {
            return {};
        }
        const auto number = [](char byte) { return std::size_t{static_cast<unsigned char>(byte)}; };
        EXPECT_GE(number(head[1]), 0x80U) << "not masked";
        std::size_t size = number(head[1]) & 0x7fU;
        const std::size_t places = size < 126 ? 0 : size == 126 ? 2 : 8;
        size = places > 0 ? 0 : size;
        for (const char byte : received(places)) {
            size = size << 8U | number(byte);
        }
        const std::string mask = received(4);
        std::string content = received(size);
        for (std::size_t k = 0; k < content.size(); ++k) {
            content[k] = static_cast<char>(content[k] ^ mask[k % 4]);
        }
        return {static_cast<unsigned>(number(head[0])), content};
    }

  private:
    int socket_;
};

constexpr std::string_view accepting =
    "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    "Sec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n\r\n";

/// A server of one connection, whose part of the conversation is a function.
class Server {
  public:
    explicit Server(std::function<void(const Client&)> serve) {
        listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = ::htonl(INADDR_LOOPBACK);
        socklen_t size = sizeof address;
        EXPECT_EQ(::bind(listener_, reinterpret_cast<const sockaddr*>(&address), size), 0);
        EXPECT_EQ(::listen(listener_, 1), 0);
        EXPECT_EQ(::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size), 0);
        port = ::ntohs(address.sin_port);
        thread_ = std::thread{[this, serve = std::move(serve)] {
            const int accepted = ::accept(listener_, nullptr, nullptr);
            serve(Client{accepted});
            ::close(accepted);
        }};
    }
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;
    ~Server() {
        thread_.join();
        ::close(listener_);
    }

    std::uint16_t port = 0;

  private:
    int listener_;
    std::thread thread_;
};

/// A server that accepts the handshake before its part of the conversation.
Server accepting_server(std::function<void(const Client&)> serve) {
    return Server{[serve = std::move(serve)](const Client& client) {
        (void)client.received_until("\r\n\r\n");
        client.send(accepting);
        serve(client);
    }};
}

/// The client receives at most 16 KiB at once.
const std::string longer_than_a_part(40'000, 'x');

/// Time that ends a wait of a test in which nothing is late.
Nanoseconds late() {
    return monotonic_now() + 60 * nanoseconds_a_second;
}

Nanoseconds soon() {
    return monotonic_now() + nanoseconds_a_second / 200;
}

TEST(WebSocket, MessagesOfEachLengthArriveOnBothSides) {
    const std::vector<std::size_t> sizes{0, 1, 125, 126, 65535, 65536, std::size_t{1} << 20U};
    const Server server = accepting_server([&](const Client& client) {
        for (std::size_t k = 0; k < sizes.size(); ++k) {
            const auto [head, content] = client.received_frame();
            EXPECT_EQ(head, text);
            client.send(frame(text, content));
        }
        EXPECT_EQ(client.received_frame(), (std::pair<unsigned, std::string>{closing, "\x03\xe8"}));
    });
    WebSocket socket;
    ASSERT_EQ(socket.open("127.0.0.1", server.port, late()), "");
    for (const std::size_t size : sizes) {
        const std::string sent(size, 'm');
        std::string answer;
        socket.send(sent, late());
        ASSERT_TRUE(socket.receive(answer, late())) << size;
        EXPECT_EQ(answer, sent);
    }
    socket.close(late());
    EXPECT_FALSE(socket.is_open());
}

TEST(WebSocket, TheRequestIsThatOfTheStandard) {
    std::string request;
    {
        const Server server{[&](const Client& client) { request = client.received_until("\r\n\r\n"); }};
        WebSocket socket;
        EXPECT_EQ(socket.open("127.0.0.1", server.port, late()), "no answer");
        EXPECT_FALSE(socket.is_open());
    }
    EXPECT_TRUE(request.starts_with("GET / HTTP/1.1\r\nHost: 127.0.0.1:")) << request;
    for (const char* field : {"Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13",
                              "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=="}) {
        EXPECT_NE(request.find("\r\n" + std::string{field} + "\r\n"), std::string::npos) << field;
    }
}

void expect_first_message(const Server& server) {
    WebSocket socket;
    ASSERT_EQ(socket.open("127.0.0.1", server.port, late()), "");
    std::string message;
    EXPECT_TRUE(socket.receive(message, late()));
    EXPECT_EQ(message, "first");
}

TEST(WebSocket, AnAnswerThatAcceptsInOtherWordsAndInPiecesIsAccepted) {
    const std::string answer =
        "HTTP/1.1 101 \r\nX: y\r\nSEC-WEBSOCKET-ACCEPT:\t s3pPLMBiTxaQ9kYGzzhZRbK+xOo= \r\n\r\n";
    const Server server{[&](const Client& client) {
        (void)client.received_until("\r\n\r\n");
        for (const char byte : answer) {
            client.send({&byte, 1});
            std::this_thread::yield();
        }
        client.send(frame(text, "first"));
        (void)client.received_frame();
    }};
    expect_first_message(server);
}

TEST(WebSocket, AMessageBehindTheHandshakeInTheSamePacketIsReceived) {
    const Server server{[](const Client& client) {
        (void)client.received_until("\r\n\r\n");
        client.send(std::string{accepting} + frame(text, "first"));
        (void)client.received_frame();
    }};
    expect_first_message(server);
}

TEST(WebSocket, AServerThatDoesNotAcceptTheHandshakeIsRefused) {
    const std::string key = "Sec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n\r\n";
    for (const auto& [answer, reason] : std::vector<std::pair<std::string, const char*>>{
             {"HTTP/1.1 200 OK\r\n" + key, "the program there is no WebSocket server"},
             {"HTTP/1.1 404 Not Found\r\n\r\n", "the program there is no WebSocket server"},
             {"HTTP/1.0 101 Switching\r\n" + key, "the program there is no WebSocket server"},
             {"HTTP/1.1 101 Switching\r\nUpgrade: websocket\r\n\r\n",
              "the program there is no WebSocket server"},
             {"HTTP/1.1 101 Switching\r\nSec-WebSocket-Accept: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n",
              "the program there is no WebSocket server"},
             {"HTTP/1.1 101 Switching\r\nSec-WebSocket-Accept:\r\n\r\n",
              "the program there is no WebSocket server"},
             {"HTTP/1.1 101 Switching\r\nSec-WebSocket-Accept: s3pPL", "no answer"},
             {"HTTP/1.1 101 " + std::string(WebSocketFrames::max_message + 100'000, 'x') + "\r\n" + key,
              "no answer"},
             {"", "no answer"}}) {
        const Server server{[&answer = answer](const Client& client) {
            (void)client.received_until("\r\n\r\n");
            client.send(answer);
        }};
        WebSocket socket;
        EXPECT_EQ(socket.open("127.0.0.1", server.port, late()), reason) << answer.substr(0, 80);
        EXPECT_FALSE(socket.is_open());
    }
}

TEST(WebSocket, AnAddressWithoutAServerIsRefused) {
    WebSocket socket;
    EXPECT_EQ(socket.open("localhost", 80, late()), "'localhost' is not an address");
    const int closed = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);  // a port that nothing listens to
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = ::htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    ASSERT_EQ(::bind(closed, reinterpret_cast<const sockaddr*>(&address), size), 0);
    ASSERT_EQ(::getsockname(closed, reinterpret_cast<sockaddr*>(&address), &size), 0);
    EXPECT_EQ(socket.open("127.0.0.1", ::ntohs(address.sin_port), late()), "Connection refused");
    EXPECT_EQ(socket.open("::1", ::ntohs(address.sin_port), late()).empty(), false);
    ::close(closed);
    EXPECT_FALSE(socket.is_open());
    std::string message = "unchanged";
    EXPECT_FALSE(socket.receive(message, late()));
    socket.send("m", late());
    socket.close(late());
    EXPECT_EQ(message, "unchanged");
}

TEST(WebSocket, APingIsAnsweredWithItsContent) {
    const Server server = accepting_server([](const Client& client) {
        client.send(frame(first_part, "in ") + frame(ping, "are you there?") + frame(pong, "") +
                    frame(last_part, "parts"));
        EXPECT_EQ(client.received_frame(), (std::pair<unsigned, std::string>{pong, "are you there?"}));
    });
    WebSocket socket;
    ASSERT_EQ(socket.open("127.0.0.1", server.port, late()), "");
    std::string message;
    EXPECT_TRUE(socket.receive(message, late()));
    EXPECT_EQ(message, "in parts");
}

TEST(WebSocket, TheEndByTheServerIsConfirmedAndABrokenFrameNamesAnError) {
    for (const auto& [sent, answer] :
         std::vector<std::pair<std::string, std::string>>{{frame(closing, {"\x03\xe9", 2}), "\x03\xe8"},
                                                          {frame(closing, ""), "\x03\xe8"},
                                                          {frame(0xc1, "m"), "\x03\xea"},
                                                          {{"\x81\x81\0\0\0\0m", 7}, "\x03\xea"}}) {
        const Server server = accepting_server([&sent = sent, &answer = answer](const Client& client) {
            client.send(sent);
            EXPECT_EQ(client.received_frame(), (std::pair<unsigned, std::string>{closing, answer}));
        });
        WebSocket socket;
        ASSERT_EQ(socket.open("127.0.0.1", server.port, late()), "");
        std::string message = "unchanged";
        EXPECT_FALSE(socket.receive(message, late()));
        EXPECT_EQ(message, "unchanged");
        EXPECT_FALSE(socket.is_open());
    }
}

TEST(WebSocket, TheEndOfTheConnectionWithinAFrameEndsTheWait) {
    for (const std::string& part :
         {std::string{}, std::string{"\x81"}, std::string{"\x81\x7e\x01"}, std::string{"\x81\x05mess"}}) {
        const Server server = accepting_server([&](const Client& client) { client.send(part); });
        WebSocket socket;
        ASSERT_EQ(socket.open("127.0.0.1", server.port, late()), "");
        std::string message;
        EXPECT_FALSE(socket.receive(message, late()));
        EXPECT_FALSE(socket.is_open());
    }
}

TEST(WebSocket, BytesThatNeverMakeAMessageDoNotExtendAWait) {
    // The server sends until the client ends the connection, faster than the client reads short frames.
    const auto many = [](const std::string& one) {
        std::string bytes;
        for (int k = 0; k < 10'000; ++k) {
            bytes += one;
        }
        return bytes;
    };
    const std::string longest(WebSocketFrames::max_message, 'm');
    for (const auto& [name, first, next] : std::vector<std::tuple<const char*, std::string, std::string>>{
             {"handshake", "HTTP/1.1 101", "x"},
             {"message in bytes", std::string{accepting} + frame(text, longest).substr(0, 10), "x"},
             {"parts without content", std::string{accepting} + frame(first_part, ""),
              many(frame(middle_part, ""))},
             {"pings", std::string{accepting}, many(frame(ping, ""))}}) {
        const Server server{[&first = first, &next = next](const Client& client) {
            (void)client.received_until("\r\n\r\n");
            client.send(first);
            while (client.send(next)) {
            }
        }};
        WebSocket socket;
        const bool accepts = first.starts_with(accepting);
        EXPECT_EQ(socket.open("127.0.0.1", server.port, accepts ? late() : soon()),
                  accepts ? "" : "no answer")
            << name;
        std::string message;
        EXPECT_FALSE(socket.receive(message, soon())) << name;
        socket.close(soon());
        EXPECT_FALSE(socket.is_open()) << name;
    }
}

TEST(WebSocket, AHandshakeThatEndsBehindTheDeadlineIsRefused) {
    const Server server{[](const Client& client) {
        (void)client.received_until("\r\n\r\n");
        moved_s = 3600;
        client.send("HTTP/1.1 101 " + longer_than_a_part + "\r\n" + std::string{accepting});
    }};
    WebSocket socket;
    EXPECT_EQ(socket.open("127.0.0.1", server.port, late()), "no answer");
    moved_s = 0;
}

TEST(WebSocket, BytesBehindTheDeadlineOfACloseAreNotReceived) {
    std::promise<void> sent;
    const Server server = accepting_server([&](const Client& client) {
        client.send(longer_than_a_part);
        sent.set_value();
        EXPECT_TRUE(client.leaves_bytes_unread());
    });
    WebSocket socket;
    ASSERT_EQ(socket.open("127.0.0.1", server.port, late()), "");
    const Nanoseconds until = late();
    sent.get_future().wait();
    moved_s = 3600;
    socket.close(until);
    EXPECT_FALSE(socket.is_open());
    moved_s = 0;
}

TEST(WebSocket, AServerThatNeverReadsDoesNotExtendAWait) {
    const Server server = accepting_server([](const Client& client) {
        while (client.send(frame(ping, std::string(125, 'p')))) {
            std::this_thread::sleep_for(1ms);
        }
    });
    WebSocket socket;
    ASSERT_EQ(socket.open("127.0.0.1", server.port, late()), "");
    const std::string long_message(std::size_t{32} << 20U, 'm');
    socket.send(long_message, soon());
    EXPECT_FALSE(socket.is_open()) << "a message that is sent in part ends the connection";
}

TEST(WebSocket, TheServerEndsAConnectionThatTheClientCloses) {
    const Server server = accepting_server([](const Client& client) {
        EXPECT_EQ(client.received_frame(), (std::pair<unsigned, std::string>{text, "last"}));
        EXPECT_EQ(client.received_frame(), (std::pair<unsigned, std::string>{closing, "\x03\xe8"}));
        for (int k = 0; k < 2; ++k) {
            std::this_thread::sleep_for(5ms);
            EXPECT_TRUE(client.send(frame(text, "late"))) << "the client has not waited";
        }
    });
    WebSocket socket;
    ASSERT_EQ(socket.open("127.0.0.1", server.port, late()), "");
    socket.send("last", late());
    socket.close(late());
}

TEST(WebSocket, AMessageThatIsLateIsReceivedByALaterWait) {
    const Server server = accepting_server([](const Client& client) {
        client.send(std::string{"\x81\x04la"});
        (void)client.received_frame();
        client.send("te" + frame(text, "next"));
        (void)client.received_frame();
    });
    WebSocket socket;
    ASSERT_EQ(socket.open("127.0.0.1", server.port, late()), "");
    std::string message = "unchanged";
    EXPECT_FALSE(socket.receive(message, monotonic_now()));
    EXPECT_FALSE(socket.receive(message, soon()));
    EXPECT_EQ(message, "unchanged");
    EXPECT_TRUE(socket.is_open());
    socket.send("go on", late());
    EXPECT_TRUE(socket.receive(message, late()));
    EXPECT_EQ(message, "late");
    EXPECT_TRUE(socket.receive(message, late()));
    EXPECT_EQ(message, "next");
}

}  // namespace
}  // namespace palpate
