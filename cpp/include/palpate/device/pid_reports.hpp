// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "palpate/device/hid_descriptor.hpp"

/// Reports of a force-feedback wheel: Device Class Definition for Physical Interface Devices (PID) 1.0, usage page
/// 0x0F. The report descriptor of the device states the place of each value.
namespace palpate::hid::pid {

inline constexpr std::uint32_t page = 0x0F;  ///< usage page of the class

/// Usages of the page 0x0F.
enum Usage : std::uint8_t {
    SetEffect = 0x21,
    BlockIndex = 0x22,
    EffectType = 0x25,
    ConstantForce = 0x26,
    Spring = 0x40,
    Duration = 0x50,
    Gain = 0x52,
    AxesEnable = 0x55,
    DirectionEnable = 0x56,
    Direction = 0x57,
    SetCondition = 0x5F,
    CenterOffset = 0x60,
    PositiveCoefficient = 0x61,
    NegativeCoefficient = 0x62,
    PositiveSaturation = 0x63,
    NegativeSaturation = 0x64,
    Magnitude = 0x70,
    SetConstant = 0x73,
    EffectOperation = 0x77,
    Operation = 0x78,
    Start = 0x79,
    Stop = 0x7B,
    LoopCount = 0x7C,
    DeviceGainReport = 0x7D,
    DeviceGain = 0x7E,
    BlockLoad = 0x89,
    LoadStatus = 0x8B,
    LoadSuccess = 0x8C,
    LoadFull = 0x8D,
    LoadError = 0x8E,
    State = 0x92,
    Control = 0x96,
    EnableActuators = 0x97,
    DisableActuators = 0x98,
    StopAllEffects = 0x99,
    DeviceReset = 0x9A,
    Paused = 0x9F,
    ActuatorsEnabled = 0xA0,
    CreateEffect = 0xAB,
};

/// Bytes of a report with its number.
using Bytes = std::vector<std::uint8_t>;

/// A report of a given size and the values in it.
struct Report {
    std::uint8_t number = 0;
    std::size_t size = 0;  ///< with the byte of the number [bytes]

    [[nodiscard]] Bytes empty() const {
        Bytes bytes(size, 0);
        bytes[0] = number;
        return bytes;
    }
};

/// Returns the content of a report behind its number.
template <class Byte>
[[nodiscard]] std::span<Byte> content(std::span<Byte> report) noexcept {
    return report.empty() ? report : report.subspan(1);
}
/// Writes a code at the place of a value; without a place it does nothing.
inline void write(Bytes& report, const Value& value, std::int64_t code) noexcept {
    value.write(content(std::span{report}), code);
}
inline void write(Bytes& report, const std::optional<Value>& value, std::int64_t code) noexcept {
    if (value) {
        write(report, *value, code);
    }
}

/// Places of all values that a wheel needs. The constructor throws std::runtime_error if the device has no such place,
/// with a sentence without its subject.
class Layout {
  public:
    explicit Layout(const Reports& reports) : reports_{reports} {
        if (!reports.numbered) {
            refuse("numbered reports");
        }
        axis = found_axis();
        effect_index = need(ReportType::Output, SetEffect, BlockIndex, "Set Effect report");
        effect = report_of(ReportType::Output, effect_index.report);
        effect_type = need_field(ReportType::Output, SetEffect, EffectType, "effect type in Set Effect");
        duration = need(ReportType::Output, SetEffect, Duration, "duration of an effect");
        effect_gain = find(ReportType::Output, SetEffect, Gain);
        direction_enable = find(ReportType::Output, SetEffect, DirectionEnable);
        for (const ReportField& field : reports.fields) {
            if (field.type == ReportType::Output && field.is_inside(of(Direction)) && !direction) {
                direction = value_of(field, 0);
            }
        }
        constant_index = need(ReportType::Output, SetConstant, BlockIndex, "Set Constant Force report");
        constant = report_of(ReportType::Output, constant_index.report);
        magnitude = need(ReportType::Output, SetConstant, Magnitude, "magnitude of a constant force");
        if (magnitude.minimum >= 0) {
            refuse("constant forces in both directions");
        }
        operation_index = need(ReportType::Output, EffectOperation, BlockIndex, "Effect Operation report");
        operation = report_of(ReportType::Output, operation_index.report);
        operation_kind = need_field(ReportType::Output, EffectOperation, Operation, "Effect Operation");
        loop_count = find(ReportType::Output, EffectOperation, LoopCount);
        control_kind = need_field(ReportType::Output, Control, Control, "Device Control report");
        control = report_of(ReportType::Output, control_kind.report);
        device_gain = find(ReportType::Output, DeviceGainReport, DeviceGain);
        create_type = need_field(ReportType::Feature, CreateEffect, EffectType, "Create New Effect report");
        create = report_of(ReportType::Feature, create_type.report);
        load_index = need(ReportType::Feature, BlockLoad, BlockIndex, "PID Block Load report");
        load = report_of(ReportType::Feature, load_index.report);
        load_status = need_field(ReportType::Feature, BlockLoad, LoadStatus, "status of PID Block Load");
        is_paused = find(ReportType::Input, State, Paused);
        is_enabled = find(ReportType::Input, State, ActuatorsEnabled);
        exponent_ = duration_exponent();
        take_springs();
    }

    /// True if the device has the spring effect with all of its values.
    [[nodiscard]] bool has_springs() const noexcept { return springs_; }

    /// Returns the step of the duration of an effect [s].
    [[nodiscard]] double duration_step_s() const noexcept { return std::pow(10.0, exponent_); }

    /// Returns the report that creates an effect of a type.
    [[nodiscard]] Bytes create_effect(Usage type) const {
        Bytes report = create.empty();
        choose(report, create_type, type);
        return report;
    }

    /// Returns the report that sets duration and direction of an effect, with its full gain. The direction is 90
    /// degrees: a positive force pushes to smaller positions, as a spring does at positions above its center.
    [[nodiscard]] Bytes set_effect(std::int64_t index, Usage type, double duration_s) const {
        Bytes report = effect.empty();
        write(report, effect_index, index);
        choose(report, effect_type, type);
        const double steps = std::floor(duration_s / duration_step_s() * (1.0 + 1e-9));
        write(report, duration, std::clamp<std::int64_t>(std::llround(steps), 1, duration.maximum));
        if (effect_gain) {
            write(report, effect_gain, effect_gain->maximum);
        }
        write(report, direction_enable, 1);
        if (direction) {
            // A quarter turn as the kernel driver sends it: 0x4000 of 0xFFFF, rounded down
            write(report, direction,
                  0x4000 * (direction->maximum - direction->minimum) / 0xFFFF + direction->minimum);
        }
        return report;
    }

    /// Returns the report of a device control, such as DeviceReset.
    [[nodiscard]] Bytes device_control(Usage kind) const {
        Bytes report = control.empty();
        choose(report, control_kind, kind);
        return report;
    }

    /// Returns the report that starts or stops an effect.
    [[nodiscard]] Bytes operate(std::int64_t index, Usage kind) const {
        Bytes report = operation.empty();
        write(report, operation_index, index);
        choose(report, operation_kind, kind);
        write(report, loop_count, kind == Start ? 1 : 0);
        return report;
    }

    /// Returns the report that sets the gain of the device to its maximum; nothing without such a report.
    [[nodiscard]] std::optional<Bytes> full_gain() const {
        if (!device_gain) {
            return {};
        }
        Bytes report = report_of(ReportType::Output, device_gain->report).empty();
        write(report, device_gain, device_gain->maximum);
        return report;
    }

    /// Returns the report of a constant force of zero.
    [[nodiscard]] Bytes no_force(std::int64_t index) const {
        Bytes report = constant.empty();
        write(report, constant_index, index);
        return report;
    }

    /// Returns the report of a spring without stiffness, whose force is limited to a share of the largest one.
    [[nodiscard]] Bytes no_spring(std::int64_t index, double limit_share) const {
        Bytes report = condition.empty();
        write(report, condition_index, index);
        write(report, positive_saturation, positive_saturation.code_of(limit_share));
        write(report, negative_saturation, negative_saturation.code_of(limit_share));
        return report;
    }

    /// Returns true if the status of PID Block Load is this one.
    [[nodiscard]] bool has_status(const Bytes& report, Usage status) const noexcept {
        const auto place = load_status.place_of(of(status));
        const auto value = value_of(load_status, load_status.is_variable && place ? *place : 0);
        if (!place || !value) {
            return false;
        }
        const std::int64_t code = value->read(content(std::span{report}));
        return code ==
               (load_status.is_variable ? 1 : load_status.minimum + static_cast<std::int64_t>(*place));
    }

    /// Returns true if the effect type, the operation or the control has this usage.
    [[nodiscard]] static bool offers(const ReportField& field, Usage usage) noexcept {
        return field.place_of(of(usage)).has_value();
    }

    Value axis;  ///< position of the wheel
    Value effect_index, duration, constant_index, magnitude, operation_index, load_index;
    std::optional<Value> effect_gain, direction_enable, direction, loop_count, device_gain, is_paused,
        is_enabled;
    ReportField effect_type, operation_kind, control_kind, create_type, load_status;
    Report effect, constant, operation, control, create, load;
    // Of a spring
    Value condition_index, center, positive_coefficient, negative_coefficient, positive_saturation,
        negative_saturation;
    Report condition;

    /// Returns size and number of a report; its size is 0 if the device does not have it.
    [[nodiscard]] Report report_of(ReportType type, std::uint8_t number) const noexcept {
        return {number, reports_.size_of(type, number)};
    }
    /// Returns the size of each input report by its number, 0 if the device does not have it [bytes].
    [[nodiscard]] std::array<std::size_t, 256> input_sizes() const noexcept {
        std::array<std::size_t, 256> sizes{};
        for (std::size_t number = 0; number < sizes.size(); ++number) {
            sizes[number] = reports_.size_of(ReportType::Input, static_cast<std::uint8_t>(number));
        }
        return sizes;
    }

  private:
    [[nodiscard]] static std::uint32_t of(std::uint32_t usage) noexcept { return usage_of(page, usage); }

    [[noreturn]] static void refuse(const std::string& what) {
        throw std::runtime_error(
            "is not a force-feedback wheel of the USB class PID: its report descriptor has no " + what +
            "; choose another node");
    }

    /// Writes the choice of a usage into a list of usages, or sets its bit.
    static void choose(Bytes& report, const ReportField& field, Usage usage) noexcept {
        const auto place = field.place_of(of(usage));
        if (!place) {
            return;
        }
        if (const auto value = value_of(field, field.is_variable ? *place : 0)) {
            write(report, value, field.is_variable ? 1 : field.minimum + static_cast<std::int64_t>(*place));
        }
    }

    /// Returns the field of one usage of a collection that lists usages; nothing without one.
    [[nodiscard]] const ReportField* field_inside(ReportType type, std::uint32_t collection,
                                                  std::uint32_t inner) const noexcept {
        for (const ReportField& field : reports_.fields) {
            if (field.type == type && !field.is_constant && field.is_inside(of(collection)) &&
                field.is_inside(of(inner)) && !field.usages.empty()) {
                return &field;
            }
        }
        return nullptr;
    }
    [[nodiscard]] ReportField need_field(ReportType type, std::uint32_t collection, std::uint32_t inner,
                                         const char* name) const {
        const ReportField* const field = field_inside(type, collection, inner);
        if (field == nullptr || !value_of(*field, 0)) {
            refuse(name);
        }
        return *field;
    }

    [[nodiscard]] std::optional<Value> find(ReportType type, std::uint32_t collection,
                                            std::uint32_t usage) const noexcept {
        for (const ReportField& field : reports_.fields) {
            if (field.type == type && field.is_variable && !field.is_constant &&
                field.is_inside(of(collection))) {
                if (const auto place = field.place_of(of(usage))) {
                    return value_of(field, *place);
                }
            }
        }
        return {};
    }
    [[nodiscard]] Value need(ReportType type, std::uint32_t collection, std::uint32_t usage,
                             const char* name) const {
        const std::optional<Value> value = find(type, collection, usage);
        if (!value || value->maximum <= value->minimum) {
            refuse(name);
        }
        return *value;
    }

    /// Returns the axis on which the effects act: the first one of Axes Enable, otherwise X.
    [[nodiscard]] Value found_axis() const {
        constexpr std::uint32_t x = usage_of(0x01, 0x30);
        const ReportField* const axes = field_inside(ReportType::Output, SetEffect, AxesEnable);
        const std::uint32_t usage = axes != nullptr ? axes->usages.front() : x;
        for (const ReportField& field : reports_.fields) {
            const auto place = field.place_of(usage);
            if (field.type != ReportType::Input || !field.is_variable || !place) {
                continue;
            }
            const auto value = value_of(field, *place);
            if (value && value->maximum > value->minimum) {
                return *value;
            }
        }
        refuse("axis on which an effect acts");
    }

    [[nodiscard]] int duration_exponent() const noexcept {
        constexpr int milliseconds = -3;
        for (const ReportField& field : reports_.fields) {
            if (field.type == ReportType::Output && field.is_inside(of(SetEffect)) &&
                field.place_of(of(Duration))) {
                return field.has_unit ? field.exponent : milliseconds;
            }
        }
        return milliseconds;
    }

    void take_springs() {
        const auto value = [&](Usage usage) { return find(ReportType::Output, SetCondition, usage); };
        const auto index = value(BlockIndex);
        const auto offset = value(CenterOffset);
        const auto positive = value(PositiveCoefficient);
        const auto negative = value(NegativeCoefficient);
        const auto above = value(PositiveSaturation);
        const auto below = value(NegativeSaturation);
        springs_ = index && offset && positive && negative && above && below && offers(create_type, Spring) &&
                   offers(effect_type, Spring);
        if (!springs_) {
            return;
        }
        condition_index = *index;
        condition = report_of(ReportType::Output, index->report);
        center = *offset;
        positive_coefficient = *positive;
        negative_coefficient = *negative;
        positive_saturation = *above;
        negative_saturation = *below;
    }

    Reports reports_;
    bool springs_ = false;
    int exponent_ = -3;
};

}  // namespace palpate::hid::pid
