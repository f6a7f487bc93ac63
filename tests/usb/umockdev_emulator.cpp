// SPDX-License-Identifier: Apache-2.0
// Emulates a USB device with the library umockdev and runs a command that uses this device.
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "command.hpp"
#include "emulation.hpp"
#include "usbfs_node.hpp"

namespace emulator {
namespace {

constexpr const char* preload = "libumockdev-preload.so.0";

class Emulation {
  public:
    explicit Emulation(Settings settings) : settings_{std::move(settings)}, testbed_{umockdev_testbed_new()} {
        if (!settings_.trace.empty()) {
            trace_.open(settings_.trace);
            trace_ << EmulatedDevice::trace_header();
        }
        for (const Identity& identity : settings_.devices) {
            plug(identity, settings_.script);
        }
    }
    ~Emulation() {
        places_.clear();
        g_object_unref(testbed_);
    }
    Emulation(const Emulation&) = delete;
    Emulation& operator=(const Emulation&) = delete;

    int run() {
        const Orders orders{[this](const std::string& order) { return executed(order); }};
        Command command{settings_.command, [this] { prepare(); }};
        std::thread frames{[this] { run_frames(); }};
        const int code = command.wait();
        {
            const std::lock_guard locked{mutex_};
            over_ = true;
        }
        changed_.notify_all();
        frames.join();
        if (trace_.is_open() && !places_.empty()) {
            // The last row of the trace is the state of the emulated device after the command has ended.
            trace_ << places_.back()->node->port().device().trace_row();
        }
        return code;
    }

  private:
    struct Place {
        FrameClock clock;
        std::unique_ptr<UsbfsNode> node;
        bool removal_announced = false;
    };

    void plug(const Identity& identity, const std::vector<Fault>& script) {
        auto place = std::make_unique<Place>(
            Place{FrameClock{settings_.lock_step, settings_.rate_hz, settings_.lock_step_timeout}, nullptr});
        place->node = std::make_unique<UsbfsNode>(testbed_, make_device(settings_, identity, script),
                                                  next_address_++, mutex_, [this] {
                                                      if (begin_frames() < wakes_at_) {
                                                          changed_.notify_all();
                                                      }
                                                  });
        place->node->set_clock(place->clock);
        if (settings_.denied) {
            deny(place->node->node_file());
        }
        const std::lock_guard locked{mutex_};
        places_.push_back(std::move(place));
    }

    /// Gives all permissions on every file except the file of the device, which then cannot be opened.
    void deny(const std::string& node) {
        namespace fs = std::filesystem;
        gchar* root = umockdev_testbed_get_root_dir(testbed_);
        fs::permissions(root, fs::perms::all);
        for (const auto& entry : fs::recursive_directory_iterator(root)) {
            if (!entry.is_symlink()) {
                fs::permissions(entry.path(), fs::perms::all);
            }
        }
        g_free(root);
        fs::permissions(node, fs::perms::none);
    }

    /// Sets the preloaded libraries and the user for the command; called in the child process that runs the command.
    void prepare() {
        const std::string first = settings_.preload_first;
        ::setenv("LD_PRELOAD", (first + (first.empty() ? "" : ":") + preload).c_str(), 1);
        if (settings_.denied && ::getuid() == 0) {
            constexpr uid_t unprivileged = 65'534;
            if (::setgid(unprivileged) != 0 || ::setuid(unprivileged) != 0) {
                ::_exit(126);
            }
        }
    }

    /// Executes every USB frame that is due and returns the time of the next frame. The caller must hold the mutex.
    FrameClock::Clock::time_point begin_frames() {
        auto next = FrameClock::Clock::now() + std::chrono::milliseconds{50};
        for (const std::unique_ptr<Place>& place : places_) {
            Port& port = place->node->port();
            auto until = next;
            while (!port.device().is_unplugged() &&
                   place->clock.is_due(port, FrameClock::Clock::now(), until)) {
                place->node->frame();
                if (trace_.is_open()) {
                    trace_ << port.device().trace_row();
                }
                if (port.device().is_unplugged()) {
                    changed_.notify_all();
                }
            }
            next = std::min(next, until);
        }
        return next;
    }

    void run_frames() {
        ::prctl(PR_SET_TIMERSLACK, 1000);
        std::unique_lock locked{mutex_};
        while (!over_) {
            for (const std::unique_ptr<Place>& place : places_) {
                place->node->remove_closed_clients();
            }
            const FrameClock::Clock::time_point next = begin_frames();
            for (const std::unique_ptr<Place>& place : places_) {
                if (place->node->port().device().is_unplugged() &&
                    !std::exchange(place->removal_announced, true)) {
                    locked.unlock();
                    place->node->announce_removal();
                    locked.lock();
                    break;
                }
            }
            wakes_at_ = next;
            changed_.wait_until(locked, next);
            wakes_at_ = {};
        }
    }

    std::string executed(const std::string& order) {
        if (order == "plug") {
            plug(settings_.devices.front(), {});
            places_.back()->node->announce_arrival();
            return "ok";
        }
        const std::lock_guard locked{mutex_};
        return execute_order(places_.back()->node->port(), order);
    }

    Settings settings_;
    UMockdevTestbed* testbed_;
    std::ofstream trace_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::vector<std::unique_ptr<Place>> places_;
    FrameClock::Clock::time_point wakes_at_{};  ///< time at which the frame thread wakes up
    int next_address_ = 2;
    bool over_ = false;
};

}  // namespace
}  // namespace emulator

int main(int count, char** words) {
    // The emulator and the command both use the umockdev testbed, through the same preloaded library.
    const char* preloaded = std::getenv("LD_PRELOAD");
    if (preloaded == nullptr || std::string(preloaded).find(emulator::preload) == std::string::npos) {
        ::setenv("LD_PRELOAD", emulator::preload, 1);
        ::execv("/proc/self/exe", words);
    }
    try {
        const bool help_only = count == 2 && std::string(words[1]) == "--help";
        emulator::Settings settings =
            help_only ? emulator::Settings{} : emulator::read_settings(count, words);
        if (settings.command.empty()) {
            std::cerr << "Usage: umockdev_emulator [OPTIONS] -- COMMAND...\n\n" << emulator::options_text;
            return help_only ? 0 : 2;
        }
        emulator::Emulation emulation{std::move(settings)};
        return emulation.run();
    } catch (const std::exception& error) {
        std::cerr << "umockdev_emulator: " << error.what() << "\n";
        return 2;
    }
}
