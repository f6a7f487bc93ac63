// SPDX-License-Identifier: Apache-2.0
//
// Renders virtual springs on a pendulum, a device class of this file. 11_own_device.py draws its motion.
//
//     c++ -std=c++20 -O2 -I cpp/include examples/11_own_device.cpp -o pendulum && ./pendulum motion.csv

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <numbers>

#include "palpate/device/device.hpp"
#include "palpate/model/network.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/run/controller.hpp"

using namespace palpate;

/// Pendulum with a motor at its pivot. A real device class writes the force to a bus and reads the encoder.
class Pendulum {
  public:
    static constexpr double inertia = 0.01;  ///< [kg*m^2]
    static constexpr double gravity = 0.2;   ///< torque of gravity at 90 degrees [N*m]

    Opened open() {
        now_ = {.position = 0.1};
        return {};
    }
    Reading exchange(const Command& command) noexcept {
        for (int step = 0; step < 100; ++step) {  // 1 ms in steps of 10 us
            now_.velocity -= 1e-5 / inertia * (gravity * std::sin(now_.position) + command.force);
            now_.position += 1e-5 * now_.velocity;
        }
        now_.applied = command.force;
        now_.device_time = 1e-3 * static_cast<double>(++now_.sequence);
        return now_;
    }
    void close() noexcept {}

  private:
    Reading now_;
};
static_assert(Device<Pendulum>);

int main(int count, char** arguments) {
    std::ofstream file{count > 1 ? arguments[1] : "/dev/null"};
    file << "stiffness,time_s,angle_rad\n";
    for (const double stiffness : {0.0, 0.2, 0.5, 1.0}) {
        // The object: a spring, so that the correct frequency is known.
        const NetworkParameters line{
            .dimension = 1, .alpha = {}, .beta = {}, .weight = {}, .linear = {stiffness}, .bias = 0.0};
        Domain range;
        range.lower = {-1.0};
        range.upper = {1.0};

        // The control loop is that of every device. Here it ends after 20 s of the device's clock.
        Pendulum pendulum;
        if (const Opened opened = pendulum.open(); !opened) {
            std::printf("%s\n", opened.reason.c_str());
            return 1;
        }
        Controller controller{pendulum, Direct{WaveletNetwork{line, range}}, ForceLimit{5.0}};
        (void)controller.start();
        int passes = -1;
        double first = 0.0;
        double last = 0.0;
        Reading before;
        for (int k = 0; k < 20'000; ++k) {
            const Reading now = controller.tick().reading;
            if (before.position < 0.0 &&
                now.position >= 0.0) {  // the time between two samples is interpolated
                last = now.device_time - 1e-3 * now.position / (now.position - before.position);
                first = ++passes == 0 ? last : first;
            }
            before = now;
            file << stiffness << ',' << now.device_time << ',' << now.position << '\n';
        }
        controller.stop();
        const double theory = std::sqrt((Pendulum::gravity + stiffness) / Pendulum::inertia);
        std::printf("spring %.1f N*m/rad: %.3f Hz, theory %.3f Hz\n", stiffness, passes / (last - first),
                    theory / (2.0 * std::numbers::pi));
    }
}
