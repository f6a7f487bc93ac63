// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <utility>

#include "firmware.hpp"
#include "identity.hpp"

namespace emulator {

/// Device side in C99 as machine code of an ARM processor: the program of cpp/firmware/mps2 in QEMU. Each call is one
/// exchange of a request and an answer through two FIFOs, so the time of the device does not depend on the computer.
class ArmFirmware : public Firmware {
  public:
    /// Starts the program in QEMU; a file name that contains "m7" is for the board with a Cortex-M7.
    ArmFirmware(const std::string& program, const Identity& identity) : identity_{identity} {
        std::string folder = (std::filesystem::temp_directory_path() / "palpate-arm-XXXXXX").string();
        if (::mkdtemp(folder.data()) == nullptr) {
            throw std::runtime_error("cannot create a folder like " + folder);
        }
        folder_ = folder;
        const std::string requests = folder + "/requests";
        const std::string answers = folder + "/answers";
        if (::mkfifo(requests.c_str(), 0600) != 0 || ::mkfifo(answers.c_str(), 0600) != 0) {
            throw std::runtime_error("cannot create FIFOs in " + folder);
        }
        start_qemu(std::filesystem::absolute(program).string());
        requests_ = open(requests, O_WRONLY);
        answers_ = open(answers, O_RDONLY);
        ArmFirmware::restart();
    }
    ~ArmFirmware() override {
        ::close(requests_);  // the program ends when its input ends
        ::close(answers_);
        ::kill(qemu_, SIGTERM);
        ::waitpid(qemu_, nullptr, 0);
        std::error_code ignored;
        std::filesystem::remove_all(folder_, ignored);
    }

    void restart() override {
        Bytes data;
        put(data, identity_.uid);
        put(data, identity_.counts_per_rev);
        put(data, identity_.capabilities);
        put(data, identity_.max_torque_uNm);
        put(data, identity_.loop_hz);
        put(data, identity_.rate_hz);
        put(data, identity_.watchdog_ms);
        put(data, identity_.ramp_ms);
        put(data, identity_.firmware);
        put(data, identity_.model_fingerprint);
        put(data, identity_.model_certificate);
        put(data, -identity_.model_uNm_per_count);
        exchange('S', 0, data);
    }
    void tick(const Sample& sample) override {
        Bytes data;
        put(data, sample.count);
        put(data, sample.velocity_cps);
        put(data, sample.sensor_uNm);
        put(data, sample.temperature_dC);
        exchange('T', sample.clock_us, data);
    }
    void out(const Bytes& packet, std::uint32_t clock_us) override { exchange('O', clock_us, packet); }
    [[nodiscard]] Bytes in() override { return data(exchange('I', 0, {})); }
    [[nodiscard]] Answer control(const Bytes& setup) override {
        const std::int32_t size = exchange('C', 0, setup);
        return size < 0 ? stalled() : Answer{0, data(size)};
    }
    void disarm() override { exchange('D', 0, {}); }
    void fault(std::uint16_t present) override {
        Bytes data;
        put(data, present);
        exchange('F', 0, data);
    }
    [[nodiscard]] FirmwareState state() const override {
        return {get<std::int32_t>(answer_, 0), get<std::uint16_t>(answer_, 4),
                get<std::uint16_t>(answer_, 6)};
    }

  private:
    static constexpr std::size_t request_size = 80;
    static constexpr std::size_t answer_size = 48;
    static constexpr int longest_answer_ms = 20'000;

    void start_qemu(const std::string& program) {
        const std::string name = std::filesystem::path(program).filename();
        const char* board = name.find("m7") == std::string::npos ? "mps2-an386" : "mps2-an500";
        qemu_ = ::fork();
        if (qemu_ == 0) {
            ::prctl(PR_SET_PDEATHSIG, SIGKILL);
            ::unsetenv("LD_PRELOAD");  // the emulated USB device is not for QEMU
            if (::chdir(folder_.c_str()) != 0) {
                ::_exit(126);
            }
            ::execlp("qemu-system-arm", "qemu-system-arm", "-M", board, "-display", "none", "-monitor",
                     "none", "-serial", "none", "-semihosting-config", "enable=on,target=native", "-kernel",
                     program.c_str(), nullptr);
            ::_exit(127);
        }
    }

    /// Opens a FIFO and waits for the program; throws if QEMU has ended.
    [[nodiscard]] int open(const std::string& path, int mode) const {
        for (int k = 0; k < 10'000; ++k) {
            // Without O_NONBLOCK the call would wait forever for a program that does not start.
            const int file = ::open(path.c_str(), mode | O_NONBLOCK | O_CLOEXEC);
            if (file >= 0) {
                ::fcntl(file, F_SETFL, mode);
                return file;
            }
            if (::waitpid(qemu_, nullptr, WNOHANG) != 0) {
                break;
            }
            ::usleep(1000);
        }
        throw std::runtime_error("qemu-system-arm does not run the program; install qemu-system-arm");
    }

    /// Sends a request and reads the answer. Returns the result of the call.
    std::int32_t exchange(char operation, std::uint32_t clock_us, const Bytes& data) {
        Bytes request{static_cast<std::uint8_t>(operation), static_cast<std::uint8_t>(data.size()), 0, 0};
        put(request, clock_us);
        request.insert(request.end(), data.begin(), data.end());
        request.resize(request_size);
        answer_.resize(answer_size);
        // A FIFO transfers so few bytes at once. Before the program has opened it, a read would return no byte.
        pollfd ready{answers_, POLLIN, 0};
        if (::write(requests_, request.data(), request_size) != ssize_t{request_size} ||
            ::poll(&ready, 1, longest_answer_ms) != 1 ||
            ::read(answers_, answer_.data(), answer_size) != ssize_t{answer_size}) {
            throw std::runtime_error("the program in QEMU has ended");
        }
        return get<std::int32_t>(answer_, 8);
    }
    [[nodiscard]] Bytes data(std::int32_t size) const {
        return {answer_.begin() + 12, answer_.begin() + 12 + size};
    }

    Identity identity_;
    std::filesystem::path folder_;
    pid_t qemu_ = -1;
    int requests_ = -1;
    int answers_ = -1;
    Bytes answer_ = Bytes(answer_size);
};

}  // namespace emulator
