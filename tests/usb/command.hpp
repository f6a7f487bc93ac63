// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

namespace emulator {

/// Receives the orders of a test to the emulator as datagrams and answers each order. The code is independent of the
/// tested library.
class Orders {
  public:
    explicit Orders(std::function<std::string(const std::string&)> execute_order)
        : path_{std::filesystem::temp_directory_path() / ("palpate-emulator-" + std::to_string(::getpid()))},
          socket_{::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)},
          execute_{std::move(execute_order)} {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        path_.string().copy(address.sun_path, sizeof address.sun_path - 1);
        ::unlink(path_.c_str());
        if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
            throw std::runtime_error("cannot open a socket at " + path_.string());
        }
        ::chmod(path_.c_str(), 0777);
        executor_ = std::thread{[this] { execute_all(); }};
    }
    ~Orders() {
        ::shutdown(socket_, SHUT_RDWR);
        executor_.join();
        ::close(socket_);
        ::unlink(path_.c_str());
    }
    Orders(const Orders&) = delete;
    Orders& operator=(const Orders&) = delete;

    /// Returns the environment variable that names the socket of the orders.
    [[nodiscard]] std::string variable() const { return "PALPATE_EMULATOR=" + path_.string(); }

  private:
    void execute_all() {
        std::array<char, 512> text{};
        sockaddr_un from{};
        while (true) {
            socklen_t size = sizeof from;
            const ssize_t length =
                ::recvfrom(socket_, text.data(), text.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
            if (length <= 0) {
                return;
            }
            std::string answer;
            try {
                answer = execute_({text.data(), static_cast<std::size_t>(length)});
            } catch (const std::exception& error) {
                answer = std::string("error: ") + error.what();
            }
            ::sendto(socket_, answer.data(), answer.size(), MSG_NOSIGNAL,
                     reinterpret_cast<const sockaddr*>(&from), size);
        }
    }

    std::filesystem::path path_;
    int socket_;
    std::function<std::string(const std::string&)> execute_;
    std::thread executor_;
};

/// Runs a command of the operating system as a child process. The child receives the signals that end this program,
/// and ends when this process ends.
class Command {
  public:
    /// Starts the command in a child process, which first runs `prepare`. Each of the `variables` is NAME=VALUE and
    /// replaces a variable of this process. This process has other threads, so its own environment does not change,
    /// and the child calls only functions that a signal handler may call.
    Command(std::vector<std::string> words, std::vector<std::string> variables,
            const std::function<void()>& prepare) {
        for (char** entry = environ; *entry != nullptr; ++entry) {
            const std::string_view variable{*entry};
            const std::string_view name = variable.substr(0, variable.find('=') + 1);
            if (std::none_of(variables.begin(), variables.end(),
                             [&](const std::string& own) { return own.starts_with(name); })) {
                variables.emplace_back(variable);
            }
        }
        const std::vector<char*> arguments = pointers(words);
        const std::vector<char*> environment = pointers(variables);
        child() = ::fork();
        if (child() == 0) {
            ::prctl(PR_SET_PDEATHSIG, SIGKILL);
            prepare();
            ::execvpe(arguments[0], arguments.data(), environment.data());
            ::perror(arguments[0]);
            ::_exit(127);
        }
        for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
            std::signal(signal, [](int number) { ::kill(child(), number); });
        }
    }

    /// Waits for the end of the child process and returns its exit code in the form that a shell uses.
    int wait() {
        int status = 0;
        while (::waitpid(child(), &status, 0) < 0 && errno == EINTR) {
        }
        return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }

  private:
    /// Returns the addresses of the texts, and a null pointer at the end.
    static std::vector<char*> pointers(std::vector<std::string>& texts) {
        std::vector<char*> addresses;
        for (std::string& text : texts) {
            addresses.push_back(text.data());
        }
        addresses.push_back(nullptr);
        return addresses;
    }

    static std::atomic<pid_t>& child() {
        static std::atomic<pid_t> process{0};
        return process;
    }
};

}  // namespace emulator
