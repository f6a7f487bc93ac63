// SPDX-License-Identifier: Apache-2.0

// Renders virtual springs on a pendulum, a device class of this file. 11_own_device.py draws its motion.

//     c++ -std=c++20 -O2 -I cpp/include examples/11_own_device.cpp -o pendulum && ./pendulum motion.csv

#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <vector>

#include "palpate/device/device.hpp"
#include "palpate/model/network.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/run/controller.hpp"

using namespace palpate;

/// Pendulum with a motor at its pivot. A real device class writes the force to a bus and reads the encoder.
struct Pendulum {
    static constexpr double inertia = 0.01;  ///< [kg*m^2]
    static constexpr double gravity = 0.2;   ///< torque of gravity at 90 degrees [N*m]
    Reading now{.position = 0.1};

    Opened open() { return {}; }
    Reading exchange(const Command& command) noexcept {
        for (int step = 0; step < 100; ++step) {  // 1 ms in steps of 10 us
            now.velocity -= 1e-5 / inertia * (gravity * std::sin(now.position) + command.force);
            now.position += 1e-5 * now.velocity;
        }
        now.applied = command.force;
        now.device_time = 1e-3 * static_cast<double>(++now.sequence);
        return now;
    }
    void close() noexcept {}
};
static_assert(Device<Pendulum>);

int main(int count, char** arguments) {
    std::ofstream file{count > 1 ? arguments[1] : "/dev/null"};
    file << "stiffness,time_s,angle_rad\n";
    for (const double stiffness : {0.0, 0.2, 0.5, 1.0}) {
        // The object: a spring, so that the correct frequency is known.
        const WaveletNetwork spring{{.linear = {stiffness}}, {.lower = {-1.0}, .upper = {1.0}}};

        // The control loop is that of every device. Here it ends after 20 s of the device's clock.
        Pendulum pendulum;
        Controller controller{pendulum, Direct{spring}, ForceLimit{5.0}};
        if (!pendulum.open() || controller.start() != Status::Ok) {
            return 1;
        }
        std::vector<double> passes;  // times at which the angle rises through zero, between two samples
        double before = 0.0;
        for (int k = 0; k < 20'000; ++k) {
            const Reading now = controller.tick().reading;
            if (before < 0.0 && now.position >= 0.0) {
                passes.push_back(now.device_time - 1e-3 * now.position / (now.position - before));
            }
            before = now.position;
            file << stiffness << ',' << now.device_time << ',' << now.position << '\n';
        }
        controller.stop();
        const double cycles = static_cast<double>(passes.size() - 1) / (passes.back() - passes.front());
        std::printf("spring %.1f N*m/rad: %.3f Hz, theory %.3f Hz\n", stiffness, cycles,
                    std::sqrt((Pendulum::gravity + stiffness) / Pendulum::inertia) / (2 * std::numbers::pi));
    }
}
