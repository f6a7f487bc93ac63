// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "palpate/io/growing_file.hpp"
#include "palpate/io/tick_record.hpp"

namespace palpate {

/// A recording that is written during a run: a CSV file with `#` lines of metadata, a header of names with units, and
/// one row for each tick. The start of the file reserves space for the exit reason and the timing of the run, which are
/// written at the end of the run.
class RecordingFile {
  public:
    /// Creates NAME.part and writes metadata and column names. Returns the reason if that is not possible. If the
    /// recording NAME exists, it is replaced at the end of the run with `force`, otherwise opening is refused.
    [[nodiscard]] std::string open(const std::string& name, RecordUnits units, const Metadata& metadata,
                                   bool force = false) {
        units_ = std::move(units);
        if (std::string reason = file_.open(name, force); !reason.empty()) {
            return reason;
        }
        std::string head;
        for (const auto& [key, value] : metadata) {
            head += line(key, value);
        }
        head += line("palpate-columns", R"({"time": "time_s", "position": "position)" +
                                            suffix_of(units_.position) + R"(", "force": "force)" +
                                            suffix_of(units_.force) + R"(", "status": "status"})");
        ended_offset_ = static_cast<off_t>(head.size());
        head += padded(line("ended", "not yet: the recording was interrupted, or is still being written"));
        timing_offset_ = static_cast<off_t>(head.size());
        head += padded(line("timing", "unknown"));
        head += column_names(units_) + "\n";
        if (file_.append(head) < head.size()) {
            const int error = file_.error();
            file_.discard();
            return name + " cannot be written: " + std::generic_category().message(error);
        }
        return "";
    }

    /// Appends one row for each tick. Only one thread at a time may call this function.
    void take(std::span<const TickRecord> ticks) noexcept {
        rows_.clear();
        for (const TickRecord& tick : ticks) {
            append_row(rows_, tick);
        }
        const std::size_t kept = file_.append(rows_);
        const auto whole = static_cast<std::uint64_t>(
            std::count(rows_.begin(), rows_.begin() + static_cast<std::ptrdiff_t>(kept), '\n'));
        written_ += whole;
        refused_ += ticks.size() - whole;
    }

    /// Writes the exit reason and the timing of the run, and renames the file to its final name. Returns "", or the
    /// reason why the file could not be renamed.
    [[nodiscard]] std::string finish(const std::string& ended, const std::string& timing) {
        file_.overwrite(ended_offset_, padded(line("ended", ended)));
        file_.overwrite(timing_offset_, padded(line("timing", timing)));
        return file_.finish();
    }

    [[nodiscard]] const GrowingFile& file() const noexcept { return file_; }
    /// Returns 0, or the error number of the write that failed and ended all writing. Any thread may call this
    /// function.
    [[nodiscard]] int error() const noexcept { return file_.error(); }
    [[nodiscard]] bool is_open() const noexcept { return file_.is_open(); }
    /// Returns the number of rows written.
    [[nodiscard]] std::uint64_t written() const noexcept { return written_; }
    /// Returns the number of rows that could not be written.
    [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }

  private:
    /// Length of each metadata line that is rewritten when the recording ends [bytes]
    static constexpr std::size_t reserved_bytes = 512;

    [[nodiscard]] static std::string line(const std::string& key, std::string value) {
        for (char& letter : value) {
            letter = letter == '\n' || letter == '\r' ? ' ' : letter;
        }
        return "# " + key + ": " + value + "\n";
    }

    [[nodiscard]] static std::string padded(std::string whole) {
        whole.resize(reserved_bytes, ' ');
        whole[reserved_bytes - 1] = '\n';
        if (const std::size_t end = whole.find('\n'); end < reserved_bytes - 1) {
            whole[end] = ' ';
        }
        return whole;
    }

    RecordUnits units_;
    GrowingFile file_;
    std::string rows_;
    off_t ended_offset_ = 0;
    off_t timing_offset_ = 0;
    std::uint64_t written_ = 0;
    std::uint64_t refused_ = 0;
};

}  // namespace palpate
