// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace palpate::hid {

/// Direction of a report.
enum class ReportType : std::uint8_t { Input, Output, Feature };

/// Returns a usage with its page, such as 0x000F0022 for the effect block index of the page 0x0F.
[[nodiscard]] constexpr std::uint32_t usage_of(std::uint32_t page, std::uint32_t usage) noexcept {
    return page << 16U | usage;
}

/// Fields of one main item of a report descriptor: `count` values of `bits` bits each, from the bit `first_bit` of the
/// report on. The number of the report is not part of it.
struct ReportField {
    ReportType type = ReportType::Input;
    std::uint8_t report = 0;  ///< number of the report; 0: the device has no numbers
    std::size_t first_bit = 0;
    std::size_t bits = 0;
    std::size_t count = 0;
    std::int64_t minimum = 0;  ///< logical minimum
    std::int64_t maximum = 0;  ///< logical maximum
    /// True if each value belongs to one usage; otherwise a value is the place of one of the usages in their list.
    bool is_variable = true;
    bool is_constant = false;           ///< true: padding without a meaning
    bool has_unit = false;              ///< true if the field states a unit
    int exponent = 0;                   ///< power of 10 by which a value is multiplied to get its unit
    std::vector<std::uint32_t> usages;  ///< with their page
    std::vector<std::uint32_t> inside;  ///< usages of the collections around the field, outermost first

    /// Returns the place of a usage in the list of usages; nothing if the field does not have it.
    [[nodiscard]] std::optional<std::size_t> place_of(std::uint32_t usage) const noexcept {
        const auto found = std::find(usages.begin(), usages.end(), usage);
        return found == usages.end() ? std::nullopt
                                     : std::optional{static_cast<std::size_t>(found - usages.begin())};
    }
    [[nodiscard]] bool is_inside(std::uint32_t usage) const noexcept {
        return std::find(inside.begin(), inside.end(), usage) != inside.end();
    }
};

/// Fields of all reports of a device, and the sizes of the reports.
struct Reports {
    std::vector<ReportField> fields;
    bool numbered = false;  ///< true if each report begins with its number

    /// Returns the size of a report in bytes, with the byte of its number if the reports are numbered; 0 if the device
    /// has no such report.
    [[nodiscard]] std::size_t size_of(ReportType type, std::uint8_t report) const noexcept {
        std::size_t bits = 0;
        for (const ReportField& field : fields) {
            if (field.type == type && field.report == report) {
                bits = std::max(bits, field.first_bit + field.bits * field.count);
            }
        }
        return bits == 0 ? 0 : (bits + 7) / 8 + (numbered ? 1 : 0);
    }
};

namespace detail {

/// Limits that keep the memory of a wrong descriptor small.
inline constexpr std::size_t most_report_bits = 32768;
inline constexpr std::size_t most_usages = 4096;

/// Returns the signed number in the lowest `bits` bits, 1 to 63, of a code without other bits.
[[nodiscard]] constexpr std::int64_t signed_number(std::uint64_t code, std::size_t bits) noexcept {
    const std::uint64_t sign = std::uint64_t{1} << (bits - 1U);
    return static_cast<std::int64_t>((code ^ sign) - sign);
}

/// Global and local items of a descriptor up to the next main item.
struct Items {
    std::uint32_t page = 0;
    std::int64_t minimum = 0, maximum = 0;
    std::size_t bits = 0, count = 0;
    std::uint8_t report = 0;
    std::uint32_t unit = 0;
    int exponent = 0;
};

}  // namespace detail

/// Reads a report descriptor (Device Class Definition for HID 1.11, section 6.2.2). Throws std::runtime_error with the
/// place of the first defect, as a sentence without its subject.
[[nodiscard]] inline Reports read_descriptor(std::span<const std::uint8_t> bytes) {
    const auto refuse = [](std::size_t at, const std::string& defect) {
        throw std::runtime_error("has a wrong report descriptor: byte " + std::to_string(at) + " " + defect +
                                 "; update its firmware");
    };
    Reports reports;
    detail::Items items;
    std::vector<detail::Items> pushed;
    std::vector<std::uint32_t> usages, inside;
    std::uint32_t first_usage = 0;                           // 0: not stated
    std::vector<std::size_t> used(std::size_t{3} * 256, 0);  // bits of each report so far
    const auto end_local = [&] {
        usages.clear();
        first_usage = 0;
    };
    for (std::size_t at = 0; at < bytes.size();) {
        const std::size_t start = at;
        const std::uint8_t head = bytes[at++];
        if (head == 0xFE) {  // a long item: its size, its tag, and data without a defined meaning
            if (at + 1 >= bytes.size() || at + 2U + bytes[at] > bytes.size()) {
                refuse(start, "begins an item that the end cuts");
            }
            at += 2U + bytes[at];
            continue;
        }
        const std::size_t size = (head & 3U) == 3U ? 4U : head & 3U;
        if (at + size > bytes.size()) {
            refuse(start, "begins an item that the end cuts");
        }
        std::uint32_t data = 0;
        for (std::size_t k = 0; k < size; ++k) {
            data |= static_cast<std::uint32_t>(bytes[at + k]) << 8U * k;
        }
        at += size;
        const std::int64_t number = size == 0 ? 0 : detail::signed_number(data, 8 * size);
        const std::uint32_t with_page = size == 4 ? data : hid::usage_of(items.page, data);
        switch (head & 0xFCU) {
            case 0x80:    // input
            case 0x90:    // output
            case 0xB0: {  // feature
                ReportField field;
                field.type = (head & 0xFCU) == 0x80   ? ReportType::Input
                             : (head & 0xFCU) == 0x90 ? ReportType::Output
                                                      : ReportType::Feature;
                std::size_t& bits = used[static_cast<std::size_t>(field.type) * 256 + items.report];
                if (items.count > detail::most_report_bits || items.bits > detail::most_report_bits ||
                    bits + items.bits * items.count > detail::most_report_bits) {
                    refuse(start, "makes a report longer than 4096 bytes");
                }
                field.report = items.report;
                field.first_bit = bits;
                field.bits = items.bits;
                field.count = items.count;
                field.is_constant = (data & 1U) != 0;
                field.is_variable = (data & 2U) != 0;
                field.has_unit = items.unit != 0;
                field.exponent = items.exponent;
                field.minimum = items.minimum;
                // A maximum below the minimum is an unsigned number that its sign bit makes negative
                const std::uint64_t wrap = std::uint64_t{1} << std::min<std::size_t>(items.bits, 32);
                field.maximum = items.maximum < items.minimum
                                    ? items.maximum + static_cast<std::int64_t>(wrap)
                                    : items.maximum;
                field.usages = usages;
                field.inside = inside;
                bits += items.bits * items.count;
                reports.fields.push_back(std::move(field));
                end_local();
                break;
            }
            case 0xA0:  // collection
                inside.push_back(usages.empty() ? 0 : usages.back());
                end_local();
                break;
            case 0xC0:  // end of a collection
                if (inside.empty()) {
                    refuse(start, "ends a collection that did not begin");
                }
                inside.pop_back();
                end_local();
                break;
            case 0x04:
                items.page = data;
                break;
            case 0x14:
                items.minimum = number;
                break;
            case 0x24:
                items.maximum = number;
                break;
            case 0x54:  // one nibble from -8 to 7; some devices write a whole byte
                items.exponent = static_cast<int>(data > 7 && data < 16 ? number - 16 : number);
                break;
            case 0x64:
                items.unit = data;
                break;
            case 0x74:
                items.bits = data;
                break;
            case 0x84:
                if (data == 0 || data > 255) {
                    refuse(start, "states the report number " + std::to_string(data) + ", must be 1 to 255");
                }
                items.report = static_cast<std::uint8_t>(data);
                reports.numbered = true;
                break;
            case 0x94:
                items.count = data;
                break;
            case 0xA4:
                pushed.push_back(items);
                break;
            case 0xB4:
                if (pushed.empty()) {
                    refuse(start, "takes back items that were not stored");
                }
                items = pushed.back();
                pushed.pop_back();
                break;
            case 0x08:
                usages.push_back(with_page);
                break;
            case 0x18:
                first_usage = with_page;
                break;
            case 0x28:
                for (std::uint32_t usage = first_usage == 0 ? with_page : first_usage;
                     usage <= with_page && usages.size() < detail::most_usages; ++usage) {
                    usages.push_back(usage);
                }
                first_usage = 0;
                break;
            default:
                break;  // physical range, designator and string have no effect
        }
        if (inside.size() > 64 || pushed.size() > 64 || usages.size() > detail::most_usages) {
            refuse(start, "nests deeper than 64 collections or states more than 4096 usages");
        }
    }
    if (!inside.empty()) {
        refuse(bytes.size(), "is the end, but a collection is open");
    }
    return reports;
}

/// One value of a report: its place, size and range.
struct Value {
    std::uint8_t report = 0;
    std::size_t first_bit = 0;  ///< without the byte of the report's number
    std::size_t bits = 0;
    std::int64_t minimum = 0;
    std::int64_t maximum = 0;

    /// Returns the code of a share from -1 to 1 of the range, or from 0 to 1 if the range has no negative numbers; the
    /// nearest whole number. Zero has the code 0, and the share -1 the code -maximum.
    [[nodiscard]] std::int64_t code_of(double share) const noexcept {
        const double within = std::isnan(share) ? 0.0 : std::clamp(share, minimum < 0 ? -1.0 : 0.0, 1.0);
        const double from = minimum < 0 ? 0.0 : static_cast<double>(minimum);
        return std::llround(from + within * (static_cast<double>(maximum) - from));
    }
    /// Returns the share from -1 to 1 of a position: its distance from the middle of the range.
    [[nodiscard]] double share_of(std::int64_t code) const noexcept {
        return (static_cast<double>(code) - middle()) * step();
    }
    /// Returns the code of a position: the inverse of `share_of`, the nearest whole number within the range.
    [[nodiscard]] std::int64_t code_of_position(double share) const noexcept {
        const double within = std::isnan(share) ? 0.0 : std::clamp(share, -1.0, 1.0);
        return std::llround(middle() + within * (static_cast<double>(maximum) - middle()));
    }
    /// Returns the share of one step of a position.
    [[nodiscard]] double step() const noexcept { return 1.0 / (static_cast<double>(maximum) - middle()); }
    [[nodiscard]] bool contains(std::int64_t code) const noexcept {
        return code >= minimum && code <= maximum;
    }

    /// Reads the value from the content of a report. Bits outside of the content are 0.
    [[nodiscard]] std::int64_t read(std::span<const std::uint8_t> content) const noexcept {
        std::uint64_t code = 0;
        for (std::size_t k = 0; k < bits; ++k) {
            const std::size_t bit = first_bit + k;
            if (bit / 8 < content.size()) {
                const std::uint64_t byte = content[bit / 8];
                code |= (byte >> bit % 8 & 1U) << k;
            }
        }
        return minimum < 0 && bits > 0 ? detail::signed_number(code, bits) : static_cast<std::int64_t>(code);
    }
    /// Writes the value into the content of a report.
    void write(std::span<std::uint8_t> content, std::int64_t code) const noexcept {
        for (std::size_t k = 0; k < bits; ++k) {
            const std::size_t bit = first_bit + k;
            if (bit / 8 < content.size()) {
                const unsigned mask = 1U << bit % 8;
                const bool is_set = (static_cast<std::uint64_t>(code) >> k & 1U) != 0;
                const unsigned byte = content[bit / 8];
                content[bit / 8] = static_cast<std::uint8_t>(is_set ? byte | mask : byte & ~mask);
            }
        }
    }

  private:
    /// Returns the code of the position 0.
    [[nodiscard]] double middle() const noexcept {
        return minimum < 0 ? 0.0 : 0.5 * (static_cast<double>(minimum) + static_cast<double>(maximum));
    }
};

/// Returns the value of a usage in a field; nothing if the field does not have it or its size is not 1 to 32 bits.
[[nodiscard]] inline std::optional<Value> value_of(const ReportField& field, std::size_t place) noexcept {
    if (place >= field.count || field.bits == 0 || field.bits > 32) {
        return {};
    }
    return Value{field.report, field.first_bit + place * field.bits, field.bits, field.minimum,
                 field.maximum};
}

}  // namespace palpate::hid
