// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iostream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace emulator {

/// Receives the orders of a test to the emulator as datagrams and answers each order. The code is independent of the
/// tested library. The environment variable PALPATE_EMULATOR names the socket.
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
        ::setenv("PALPATE_EMULATOR", path_.c_str(), 1);
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
    /// Starts the command in a child process, which first runs `prepare`.
    Command(std::vector<std::string> words, const std::function<void()>& prepare) {
        child() = ::fork();
        if (child() == 0) {
            ::prctl(PR_SET_PDEATHSIG, SIGKILL);
            prepare();
            std::vector<char*> pointers;
            for (std::string& word : words) {
                pointers.push_back(word.data());
            }
            pointers.push_back(nullptr);
            ::execvp(pointers[0], pointers.data());
            std::cerr << words[0] << ": " << std::generic_category().message(errno) << "\n";
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
    static std::atomic<pid_t>& child() {
        static std::atomic<pid_t> process{0};
        return process;
    }
};

}  // namespace emulator
