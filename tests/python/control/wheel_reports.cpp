// SPDX-License-Identifier: Apache-2.0
// Prints the reports that a wheel gets, one a line: F for a feature report, O for an output report, then hexadecimal
// digits. First those of opening it, then those of each line of standard input, then those of closing it. Three dots
// separate the parts.
//
//     wheel_reports DESCRIPTOR HALF_RANGE TORQUE STIFFNESS WATCHDOG_S     force position stiffness
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <vector>

#include "palpate/device/wheel_device.hpp"

namespace {

/// A node that prints every report and stores each effect in the next block.
class PrintingNode {
  public:
    explicit PrintingNode(std::vector<std::uint8_t> descriptor) : descriptor_{std::move(descriptor)} {}
    palpate::Opened open(const std::string& /*path*/) { return {}; }
    void close() noexcept {}
    [[nodiscard]] const std::vector<std::uint8_t>& descriptor() const noexcept { return descriptor_; }
    palpate::hid::Written write(std::span<const std::uint8_t> report) noexcept {
        print('O', report);
        return palpate::hid::Written::Yes;
    }
    palpate::hid::Received receive(std::span<std::uint8_t> report, std::size_t& size,
                                   palpate::Nanoseconds /*deadline*/) noexcept {
        if (sent_position_) {
            return palpate::hid::Received::None;
        }
        sent_position_ = true;
        report[0] = 1;
        size = report.size() - 1;
        return palpate::hid::Received::Report;
    }
    bool set_feature(std::span<const std::uint8_t> report) noexcept {
        print('F', report);
        ++block_;
        return true;
    }
    bool get_feature(std::span<std::uint8_t> report) noexcept {
        report[1] = block_;
        report[2] = 1;
        return true;
    }

  private:
    static void print(char letter, std::span<const std::uint8_t> report) {
        std::printf("%c", letter);
        for (const unsigned byte : report) {
            std::printf("%02x", byte);
        }
        std::printf("\n");
    }
    std::vector<std::uint8_t> descriptor_;
    bool sent_position_ = false;
    std::uint8_t block_ = 0;
};

}  // namespace

int main(int count, char** arguments) {
    if (count != 6) {
        return 2;
    }
    std::ifstream file{arguments[1], std::ios::binary};
    const std::vector<std::uint8_t> descriptor{std::istreambuf_iterator<char>{file}, {}};
    palpate::WheelSettings settings;
    settings.half_range = std::atof(arguments[2]);
    settings.torque = settings.torque_limit = std::atof(arguments[3]);
    settings.stiffness = std::atof(arguments[4]);
    settings.watchdog_s = std::atof(arguments[5]);
    settings.wait = 0;
    palpate::WheelDevice<PrintingNode> wheel{settings, PrintingNode{descriptor}};
    if (const palpate::Opened opened = wheel.open(); !opened) {
        std::fprintf(stderr, "%s\n", opened.reason.c_str());
        return 1;
    }
    palpate::Command command;
    while (std::scanf("%lf %lf %lf", &command.force, &command.position, &command.stiffness) == 3) {
        std::printf("...\n");
        (void)wheel.exchange(command);
    }
    std::printf("...\n");
    (void)wheel.close();
}
