// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "palpate/device/wheel_device.hpp"

namespace palpate::test {

/// Writes a report descriptor.
class DescriptorWriter {
  public:
    DescriptorWriter& item(unsigned tag, std::int64_t value, int size) {
        bytes.push_back(static_cast<std::uint8_t>(tag | (size == 4 ? 3U : static_cast<unsigned>(size))));
        for (int k = 0; k < size; ++k) {
            bytes.push_back(static_cast<std::uint8_t>(value >> 8 * k & 0xFF));
        }
        return *this;
    }
    DescriptorWriter& page(unsigned page) { return item(0x04, page, 1); }
    DescriptorWriter& usages(std::initializer_list<unsigned> usages) {
        for (const unsigned usage : usages) {
            item(0x08, usage, 1);
        }
        return *this;
    }
    DescriptorWriter& begin(unsigned usage, unsigned report = 0) {
        usages({usage}).item(0xA0, 2, 1);
        return report > 0 ? item(0x84, report, 1) : *this;
    }
    DescriptorWriter& end() { return item(0xC0, 0, 0); }
    /// `tag` is 0x80 input, 0x90 output, 0xB0 feature; `flags` 2 values, 0 a list, 3 padding.
    DescriptorWriter& values(unsigned tag, int bits, int count, std::int64_t low, std::int64_t high,
                             unsigned flags = 2) {
        return item(0x14, low, 4)
            .item(0x24, high, 4)
            .item(0x74, bits, 1)
            .item(0x94, count, 1)
            .item(tag, flags, 1);
    }

    std::vector<std::uint8_t> bytes;
};

/// A wheel in memory with its reports and faults. Its reports differ from those of every published wheel: other numbers,
/// other ranges, an unsigned axis, and lists in place of bits. It reads the reports at fixed places, without the
/// functions that it tests.
class EmulatedWheel {
  public:
    static constexpr double half_range = 1.5;
    static constexpr double full_torque = 4.0;
    static constexpr double full_stiffness = 20.0;
    static constexpr int axis_top = 60000;  ///< code of the upper end; 16 bits hold more

    /// Returns a device on a copy of this wheel.
    [[nodiscard]] WheelDevice<EmulatedWheel> device(WheelSettings settings = {}) const {
        settings.half_range = half_range;
        settings.torque = full_torque;
        settings.torque_limit = full_torque;
        settings.stiffness = full_stiffness;
        settings.watchdog_s = watchdog_s;
        settings.wait = 0;
        return WheelDevice<EmulatedWheel>{settings, *this};
    }
    [[nodiscard]] static std::vector<std::uint8_t> whole_descriptor(bool spring = true,
                                                                    bool two_ways = true) {
        DescriptorWriter to;
        to.page(1).begin(4, 7).usages({0x39}).values(0x80, 8, 1, 0, 255);
        to.usages({0x30}).values(0x80, 16, 1, 0, axis_top);
        to.page(0x0F)
            .begin(0x92, 9)
            .usages({0xA0, 0x9F})
            .values(0x80, 1, 2, 0, 1)
            .values(0x80, 6, 1, 0, 1, 3);
        to.end();
        to.begin(0x21, 21).begin(0x25).usages({0x40, 0x26}).values(0x90, 8, 1, 1, 2, 0).end();
        to.usages({0x22}).values(0x90, 8, 1, 1, 14).item(0x64, 0x1003, 2).item(0x54, 0x0D, 1);
        to.usages({0x50}).values(0x90, 16, 1, 0, 30000).item(0x64, 0, 1).item(0x54, 0, 1);
        to.usages({0x52}).values(0x90, 8, 1, 0, 100).usages({0x56}).values(0x90, 8, 1, 0, 1);
        to.begin(0x57).usages({0x01}).values(0x90, 8, 1, 0, 255).end().end();
        if (spring) {
            to.begin(0x5F, 22).usages({0x22}).values(0x90, 8, 1, 1, 14);
            to.usages({0x63, 0x64}).values(0x90, 16, 2, 0, 10000);
            to.usages({0x60, 0x61, 0x62}).values(0x90, 16, 3, -10000, 10000);
            to.usages({0x65}).values(0x90, 16, 1, 0, 10000).end();
        }
        to.begin(0x73, 23).usages({0x70}).values(0x90, 16, 1, two_ways ? -4000 : 0, 4000);
        to.usages({0x22}).values(0x90, 8, 1, 1, 14).end();
        to.begin(0x77, 24).begin(0x78).usages({0x7B, 0x79}).values(0x90, 8, 1, 1, 2, 0).end();
        to.usages({0x22}).values(0x90, 8, 1, 1, 14).usages({0x7C}).values(0x90, 8, 1, 0, 255).end();
        to.begin(0x95, 25)
            .begin(0x96)
            .usages({0x9A, 0x98, 0x97, 0x99})
            .values(0x90, 8, 1, 1, 4, 0)
            .end()
            .end();
        to.begin(0x7D, 26).usages({0x7E}).values(0x90, 8, 1, 0, 200).end();
        to.begin(0xAB, 31).begin(0x25).usages({0x40, 0x26}).values(0xB0, 8, 1, 1, 2, 0).end().end();
        to.begin(0x89, 32).begin(0x8B).usages({0x8E, 0x8D, 0x8C}).values(0xB0, 8, 1, 1, 3, 0).end();
        to.usages({0x22}).values(0xB0, 8, 1, 1, 14).end();
        return to.end().bytes;
    }

    // The node
    Opened open(const std::string& /*name*/) { return {open_failure}; }
    void close() noexcept {}
    [[nodiscard]] const std::vector<std::uint8_t>& descriptor() const noexcept { return descriptor_bytes; }
    [[nodiscard]] hid::Written write(std::span<const std::uint8_t> report) noexcept {
        if (gone || refuses) {
            return hid::Written::Gone;
        }
        if (busy) {
            return hid::Written::Busy;
        }
        sent.emplace_back(report.begin(), report.end());
        obey(sent.back());
        return hid::Written::Yes;
    }
    [[nodiscard]] hid::Received receive(std::span<std::uint8_t> report, std::size_t& size,
                                        Nanoseconds deadline) noexcept {
        if (gone) {
            return hid::Received::Gone;
        }
        if (waiting.empty()) {
            if (deadline > 0) {
                waiting.insert(waiting.end(), delayed.begin(), delayed.end());
                delayed.clear();
            }
            return hid::Received::None;
        }
        size = std::min(waiting.front().size(), report.size());
        std::copy_n(waiting.front().begin(), size, report.begin());
        waiting.pop_front();
        return hid::Received::Report;
    }
    [[nodiscard]] bool set_feature(std::span<const std::uint8_t> report) noexcept {
        if (refuses_effects || report[0] != 31) {
            return false;
        }
        loaded = full ? 0 : one_block ? 3 : static_cast<int>(effects.size()) + 1;
        if (!full) {
            effects[loaded].kind = report[1];  // 1 spring, 2 constant force
        }
        return true;
    }
    [[nodiscard]] bool get_feature(std::span<std::uint8_t> report) noexcept {
        if (no_load || report[0] != 32) {
            return false;
        }
        report[0] = wrong_load ? 33 : 32;
        report[1] = full ? 2 : load_error ? 1 : never_loads ? 0 : 3;
        report[2] = static_cast<std::uint8_t>(wrong_block ? 99 : loaded);
        return true;
    }

    struct Effect {
        int kind = 0;
        double duration_s = 0.0;
        Nanoseconds started = 0;  ///< 0: stopped
        int magnitude = 0, center = 0, coefficient = 0, negative_coefficient = 0, saturation = 0;
    };

    /// Returns the torque of the motor, > 0 to larger positions [N*m].
    [[nodiscard]] double torque() const noexcept {
        double force = 0.0;
        for (const auto& [index, effect] : effects) {
            const auto age = static_cast<double>(monotonic_now() - effect.started) * 1e-9;
            if (!enabled || effect.started == 0 || age > effect.duration_s) {
                continue;
            }
            const double away = position - half_range * effect.center / 10000.0;
            const int coefficient = away > 0.0 ? effect.coefficient : effect.negative_coefficient;
            const double limit = full_torque * effect.saturation / 10000.0;
            force += effect.kind == 2
                         ? full_torque * effect.magnitude / 4000.0
                         : std::clamp(full_stiffness * coefficient / 10000.0 * away, -limit, limit);
        }
        return -force;
    }

    /// Advances the time by a tick: the wheel turns and reports its position.
    void step() noexcept {
        ++ticks;
        position = 0.1 + 0.02 * std::sin(0.05 * ticks) + (shakes && ticks % 2 == 0 ? -jump : jump);
        if (silent) {
            return;
        }
        const int code = end_code >= 0
                             ? end_code
                             : static_cast<int>(std::lround(axis_top / 2.0 * (1.0 + position / half_range)));
        std::vector<std::uint8_t> report{number, 0, static_cast<std::uint8_t>(code & 0xFF),
                                         static_cast<std::uint8_t>(code >> 8)};
        report.resize(size < 0 ? report.size() : static_cast<std::size_t>(size));
        for (int k = 0; k < copies; ++k) {
            (late ? delayed : waiting).push_back(report);
        }
        if (reports_state) {
            waiting.push_back({9, static_cast<std::uint8_t>((reports_disabled ? 0 : 1) | (paused ? 2 : 0))});
        }
    }

    double watchdog_s = 10.0;  ///< longer than any pause of a busy machine
    std::string open_failure;
    std::vector<std::uint8_t> descriptor_bytes = whole_descriptor();
    bool gone = false, refuses = false, busy = false, silent = false, late = false, shakes = false,
         paused = false, reports_disabled = false, reports_state = false;
    bool refuses_effects = false, full = false, one_block = false, no_load = false, wrong_load = false,
         load_error = false, never_loads = false, wrong_block = false;
    std::uint8_t number = 7;  ///< number of the reports of the position
    int size = -1;            ///< size of these reports; -1: the right one
    int end_code = -1;        ///< code of the position; -1: the right one
    int copies = 1;
    double jump = 0.0;
    int ticks = 0, loaded = 0;
    bool enabled = false;
    double position = 0.1;
    std::map<int, Effect> effects;
    std::vector<std::vector<std::uint8_t>> sent;                                 ///< output reports
    std::deque<std::vector<std::uint8_t>> waiting{{7, 0, 0xD0, 0x7D}}, delayed;  ///< 0x7DD0: 0.108 rad

  private:
    void obey(const std::vector<std::uint8_t>& r) noexcept {
        const auto at = [&r](std::size_t k) {
            const int code = r[k] | r[k + 1] << 8;
            return code < 32768 ? code : code - 65536;
        };
        if (r[0] == 25) {
            enabled = r[1] == 3 || (enabled && r[1] > 4);
            if (r[1] == 1) {
                effects.clear();
            }
            waiting.push_back({9, static_cast<std::uint8_t>(enabled ? 1 : 0)});
        } else if (r[0] == 21 && effects.contains(r[2])) {
            effects[r[2]].duration_s = 1e-3 * at(3);
        } else if (r[0] == 22 && effects.contains(r[1])) {
            Effect& spring = effects[r[1]];
            spring.saturation = std::min(at(2), at(4));
            spring.center = at(6);
            spring.coefficient = at(8);
            spring.negative_coefficient = at(10);
        } else if (r[0] == 23 && effects.contains(r[3])) {
            effects[r[3]].magnitude = at(1);
        } else if (r[0] == 24 && effects.contains(r[2])) {
            effects[r[2]].started = r[1] == 2 ? monotonic_now() : 0;
        }
    }
};

}  // namespace palpate::test
