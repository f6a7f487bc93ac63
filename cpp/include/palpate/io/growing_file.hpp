// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

namespace palpate {

/// A text file that grows as NAME.part, whole lines at a time, and gets its name when it is finished. What was
/// written stays readable whatever happens to the program. When the disk takes no more, the file is cut back to
/// its last whole line and nothing is written any longer; the reason is kept.
class GrowingFile {
  public:
    GrowingFile() = default;
    ~GrowingFile() { close(); }
    GrowingFile(const GrowingFile&) = delete;
    GrowingFile& operator=(const GrowingFile&) = delete;

    /// Opens NAME.part, or gives the reason why that is not possible. A NAME.part that is there already is the
    /// only copy of a recording that was cut off: it is moved to the first free NAME.1.part, NAME.2.part, ...
    [[nodiscard]] std::string open(const std::string& name) {
        name_ = name;
        struct stat there{};
        if (stat(name.c_str(), &there) == 0 && !S_ISREG(there.st_mode)) {
            return name + " cannot be written: it is not an ordinary file";
        }
        if (stat(part().c_str(), &there) == 0) {
            if (std::string reason = set_aside(); !reason.empty()) {
                return reason;
            }
        }
        descriptor_ = ::open(part().c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        return descriptor_ >= 0 ? "" : name + " cannot be written: " + std::generic_category().message(errno);
    }

    [[nodiscard]] bool is_open() const noexcept { return descriptor_ >= 0; }
    [[nodiscard]] std::string part() const { return name_ + ".part"; }
    /// Where a recording that was cut off earlier was moved to; empty if there was none.
    [[nodiscard]] const std::string& set_aside_as() const noexcept { return set_aside_as_; }
    /// 0, or the errno of the write after which nothing was written any longer.
    /// From any thread.
    [[nodiscard]] int error() const noexcept { return error_.load(std::memory_order_relaxed); }

    /// Appends whole lines. Returns how much of them is in the file: less than all means that the disk is full,
    /// or worse, and that nothing will be written any longer.
    std::size_t append(std::string_view lines) noexcept {
        if (descriptor_ < 0 || error() != 0) {
            return 0;
        }
        std::size_t done = 0;
        while (done < lines.size()) {
            const ssize_t wrote = ::write(descriptor_, lines.data() + done, lines.size() - done);
            if (wrote < 0 && errno == EINTR) {
                continue;
            }
            if (wrote <= 0) {
                error_.store(wrote < 0 ? errno : ENOSPC, std::memory_order_relaxed);
                const std::size_t whole = whole_lines(lines.substr(0, done));
                size_ += static_cast<off_t>(whole);
                (void)!::ftruncate(descriptor_, size_);
                return whole;
            }
            done += static_cast<std::size_t>(wrote);
        }
        size_ += static_cast<off_t>(lines.size());
        return done;
    }

    /// Replaces text within the file by text of the same length.
    void overwrite(off_t place, std::string_view text) noexcept {
        if (descriptor_ >= 0 && place + static_cast<off_t>(text.size()) <= size_) {
            // A failure leaves the old text, which is as readable.
            (void)!::pwrite(descriptor_, text.data(), text.size(), place);
        }
    }

    /// Gives the file its name. Returns 0 or an errno.
    [[nodiscard]] int finish() noexcept {
        close();
        return std::rename(part().c_str(), name_.c_str()) == 0 ? 0 : errno;
    }

    /// Removes NAME.part.
    void discard() noexcept {
        close();
        (void)std::remove(part().c_str());
    }

  private:
    void close() noexcept {
        if (const int descriptor = std::exchange(descriptor_, -1); descriptor >= 0) {
            ::close(descriptor);
        }
    }

    [[nodiscard]] static std::size_t whole_lines(std::string_view written) noexcept {
        const std::size_t end = written.rfind('\n');
        return end == std::string_view::npos ? 0 : end + 1;
    }

    [[nodiscard]] std::string set_aside() {
        struct stat there{};
        for (int k = 1;; ++k) {
            set_aside_as_ = name_ + "." + std::to_string(k) + ".part";
            if (stat(set_aside_as_.c_str(), &there) != 0) {
                break;
            }
        }
        if (std::rename(part().c_str(), set_aside_as_.c_str()) != 0) {
            return part() +
                   " is an earlier recording and cannot be moved: " + std::generic_category().message(errno);
        }
        return "";
    }

    std::string name_;
    std::string set_aside_as_;
    int descriptor_ = -1;
    std::atomic<int> error_{0};
    off_t size_ = 0;
};

}  // namespace palpate
