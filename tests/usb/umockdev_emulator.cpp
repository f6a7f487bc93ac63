// SPDX-License-Identifier: Apache-2.0
// Emulates a USB device with the library umockdev and runs a command that uses this device.
#include <sched.h>
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
/// The device runs on for a second after the end of the command, so that its watchdog ends the torque
constexpr int frames_after_command = 1000;

/// Keeps this process and the command on one processor: in lock-step they take turns, and a turn costs least there.
void stay_on_one_processor() {
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(static_cast<unsigned>(::sched_getcpu()), &one);
    ::sched_setaffinity(0, sizeof one, &one);
}

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
    Emulation(const Emulation&) = delete;
    Emulation& operator=(const Emulation&) = delete;

    int run() {
        const Orders orders{[this](const std::string& order) { return executed(order); }};
        std::string libraries = settings_.preload_first.empty() ? "" : settings_.preload_first + ":";
        std::vector<std::string> variables{orders.variable()};
        if (settings_.lock_step) {
            libraries += "libhost_clock.so:";
            // LD_PRELOAD itself cannot name a folder with a space
            const char* folders = std::getenv("LD_LIBRARY_PATH");
            variables.push_back("LD_LIBRARY_PATH=" PALPATE_HOST_CLOCK_FOLDER ":" +
                                std::string(folders == nullptr ? "" : folders));
        }
        variables.push_back("LD_PRELOAD=" + libraries + preload);
        Command command{settings_.command, variables, [this] { give_up_rights(); }};
        std::thread frames;
        if (!settings_.lock_step) {
            frames = std::thread{[this] { run_frames(); }};
        }
        const int code = command.wait();
        std::unique_lock locked{mutex_};
        over_ = true;
        if (frames.joinable()) {
            locked.unlock();
            changed_.notify_all();
            frames.join();
            locked.lock();
        }
        for (const std::unique_ptr<Place>& place : places_) {
            place->node->remove_clients();
        }
        for (int k = 0; k < frames_after_command; ++k) {
            execute_frame();
        }
        trace_.close();
        locked.unlock();
        g_object_unref(testbed_);
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
            Place{FrameClock{settings_.rate_hz},
                  std::make_unique<UsbfsNode>(testbed_, make_device(settings_, identity, script),
                                              next_address_++, mutex_)});
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

    /// Gives up the right to open every file, so that the device is denied also to root.
    void give_up_rights() const {
        constexpr uid_t unprivileged = 65'534;
        if (settings_.denied && ::getuid() == 0 &&
            (::setgid(unprivileged) != 0 || ::setuid(unprivileged) != 0)) {
            ::_exit(126);
        }
    }

    // The caller of these functions must hold the mutex.

    void execute_frame(Place& place) {
        Port& port = place.node->port();
        if (port.device().is_unplugged()) {
            return;
        }
        place.node->frame();
        if (trace_.is_open()) {
            trace_ << port.device().trace_row();
        }
    }

    /// Executes a frame of every device. Returns its duration.
    FrameClock::Clock::duration execute_frame() {
        FrameClock::Clock::duration frame = FrameClock{settings_.rate_hz}.frame(false);
        for (const std::unique_ptr<Place>& place : places_) {
            place->node->remove_closed_clients();
            execute_frame(*place);
            frame = place->clock.frame(place->node->port().device().is_slow());
        }
        return frame;
    }

    /// Executes every frame that is due, and returns the time of the next frame.
    FrameClock::Clock::time_point execute_due_frames() {
        auto next = FrameClock::Clock::now() + std::chrono::milliseconds{50};
        for (const std::unique_ptr<Place>& place : places_) {
            const EmulatedDevice& device = place->node->port().device();
            place->node->remove_closed_clients();
            auto until = next;
            while (!device.is_unplugged() &&
                   place->clock.is_due(device.is_slow(), FrameClock::Clock::now(), until)) {
                execute_frame(*place);
            }
            next = std::min(next, until);
        }
        return next;
    }

    /// Announces the removal of unplugged devices, without the mutex.
    void announce_removals(std::unique_lock<std::mutex>& locked) {
        for (std::size_t k = 0; k < places_.size(); ++k) {
            Place& place = *places_[k];
            if (place.node->port().device().is_unplugged() && !std::exchange(place.removal_announced, true)) {
                locked.unlock();
                place.node->announce_removal();
                locked.lock();
            }
        }
    }

    void run_frames() {
        ::prctl(PR_SET_TIMERSLACK, 1000);
        std::unique_lock locked{mutex_};
        while (!over_) {
            const FrameClock::Clock::time_point next = execute_due_frames();
            announce_removals(locked);
            changed_.wait_until(locked, next);
        }
    }

    std::string executed(const std::string& order) {
        if (order == "plug") {
            plug(settings_.devices.front(), {});
            places_.back()->node->announce_arrival();
            return "ok";
        }
        std::unique_lock locked{mutex_};
        if (order == "frame") {
            const std::chrono::nanoseconds frame = execute_frame();
            announce_removals(locked);
            return std::to_string(frame.count());
        }
        return execute_order(places_.back()->node->port(), order);
    }

    Settings settings_;
    UMockdevTestbed* testbed_;
    std::ofstream trace_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::vector<std::unique_ptr<Place>> places_;
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
        if (settings.lock_step) {
            emulator::stay_on_one_processor();
        }
        // Never destroyed: a thread of umockdev may still execute an ioctl of a killed program
        return (new emulator::Emulation{std::move(settings)})->run();
    } catch (const std::exception& error) {
        std::cerr << "umockdev_emulator: " << error.what() << "\n";
        return 2;
    }
}
