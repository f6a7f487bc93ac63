// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

namespace palpate {

namespace detail {

/// Renames a file unless a file with the new name exists. Returns 0, or the error number (EEXIST if it exists).
[[nodiscard]] inline int rename_to_free_name(const std::string& from, const std::string& to) noexcept {
    if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) {
        return 0;
    }
    if (errno != EINVAL && errno != ENOSYS) {
        return errno;
    }
    // A file system such as NFS cannot rename without replacing (RENAME_NOREPLACE): create a link instead.
    if (::link(from.c_str(), to.c_str()) != 0) {
        return errno;
    }
    return ::unlink(from.c_str()) == 0 ? 0 : errno;
}

/// Returns true if the file at `path` is the open file of `descriptor`, not another file of the same name.
[[nodiscard]] inline bool is_path_of(const std::string& path, int descriptor) noexcept {
    struct stat named{};
    struct stat open{};
    return ::lstat(path.c_str(), &named) == 0 && ::fstat(descriptor, &open) == 0 &&
           named.st_dev == open.st_dev && named.st_ino == open.st_ino;
}

/// Returns the text of a system error number (errno).
[[nodiscard]] inline std::string reason_of(int error) {
    return std::generic_category().message(error);
}

}  // namespace detail

/// A text file that is written as NAME.part, whole lines at a time, and is renamed to NAME when it is finished.
///
/// The writer holds a lock on NAME.part; a second writer of the same name is refused. Without `force` an existing file
/// is not replaced. Written lines stay readable even if the program ends abnormally. If the disk is full, the
/// incomplete last line is removed from the file, writing stops, and the error number is stored.
class GrowingFile {
  public:
    GrowingFile() = default;
    ~GrowingFile() { close(); }
    GrowingFile(const GrowingFile&) = delete;
    GrowingFile& operator=(const GrowingFile&) = delete;

    /// Creates NAME.part. Returns the reason if the file cannot be created, otherwise "". An existing NAME.part with
    /// content but without a writer is the only copy of an interrupted recording; it is renamed to the first free name
    /// of NAME.1.part, NAME.2.part, ... With `force` an existing NAME is replaced when the new file is finished; if
    /// NAME is a symbolic link, the target of the link is replaced.
    [[nodiscard]] std::string open(const std::string& name, bool force = false) {
        force_ = force;
        name_ = name;
        std::error_code error;
        if (force && std::filesystem::is_symlink(name, error)) {
            name_ = std::filesystem::canonical(name, error);
            if (error) {
                return name + " cannot be written: it is a symbolic link to a missing file";
            }
        }
        if (std::string reason = name_conflict(); !reason.empty()) {
            return reason;
        }
        // If another run finishes its recording after the first failed try, a later try to create NAME.part succeeds.
        for (int retries = 2; descriptor_ < 0; --retries) {
            descriptor_ = ::open(part().c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
            if (descriptor_ < 0 && (errno != EEXIST || retries == 0)) {
                return name_ + " cannot be written: " + detail::reason_of(errno);
            }
            if (descriptor_ < 0) {
                if (std::string reason = rename_interrupted(); !reason.empty()) {
                    return reason;
                }
            }
        }
        // Locks NAME.part. Only a program that locks the new file first can delay the lock. On a file system without
        // locks (some network file systems) no other program writes the recording either, because O_EXCL created a new
        // file.
        (void)::flock(descriptor_, LOCK_EX);
        std::string reason = name_conflict();
        if (!reason.empty()) {
            discard();
        }
        return reason;
    }

    [[nodiscard]] bool is_open() const noexcept { return descriptor_ >= 0; }
    /// Returns NAME.part.
    [[nodiscard]] std::string part() const { return name_ + ".part"; }
    /// Returns the new name of an interrupted recording that open() renamed; empty if there was none.
    [[nodiscard]] const std::string& interrupted_name() const noexcept { return interrupted_name_; }
    /// Returns 0, or the error number of the write that failed and ended all writing. Any thread may call this
    /// function.
    [[nodiscard]] int error() const noexcept { return error_.load(std::memory_order_relaxed); }

    /// Appends whole lines to the file. Returns the number of bytes of `lines` that were written. If not all bytes were
    /// written, the disk is full or failed, and writing has stopped.
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

    /// Overwrites a part of the file, from byte `place` on, with a text of the same length as that part.
    void overwrite(off_t place, std::string_view text) noexcept {
        if (descriptor_ >= 0 && place + static_cast<off_t>(text.size()) <= size_) {
            // If this write fails, the file keeps its old text, which is also valid.
            (void)!::pwrite(descriptor_, text.data(), text.size(), place);
        }
    }

    /// Writes all data to the disk and renames NAME.part to NAME. Returns "", or the reason why the file could not be
    /// renamed; the recording then keeps the name NAME.part.
    [[nodiscard]] std::string finish() {
        (void)::fsync(descriptor_);
        std::string reason;
        if (!detail::is_path_of(part(), descriptor_)) {
            reason = part() + " was moved or replaced by another program while it was written";
        } else if (const int error = rename_to_final_name(); error == EEXIST) {
            reason = name_ +
                     " was created by another program meanwhile and is not replaced; the recording is " +
                     part() + ": rename it";
        } else if (error != 0) {
            reason = "the recording keeps the name " + part() + ": " + detail::reason_of(error);
        } else {
            sync_folder();
        }
        close();  // unlocks the file, after the file has its final name
        return reason;
    }

    /// Deletes the unfinished recording NAME.part and closes it.
    void discard() noexcept {
        if (detail::is_path_of(part(), descriptor_)) {
            (void)std::remove(part().c_str());
        }
        close();
    }

  private:
    void close() noexcept {
        if (const int descriptor = std::exchange(descriptor_, -1); descriptor >= 0) {
            ::close(descriptor);
        }
    }

    [[nodiscard]] int rename_to_final_name() const noexcept {
        if (!force_) {
            return detail::rename_to_free_name(part(), name_);
        }
        return std::rename(part().c_str(), name_.c_str()) == 0 ? 0 : errno;
    }

    void sync_folder() const {
        const std::string folder = std::filesystem::path(name_).parent_path();
        const int descriptor =
            ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
        if (descriptor >= 0) {
            (void)::fsync(descriptor);
            ::close(descriptor);
        }
    }

    /// Returns the reason why a recording must not be written to NAME; empty if NAME is allowed.
    [[nodiscard]] std::string name_conflict() const {
        struct stat there{};
        if (::lstat(name_.c_str(), &there) != 0) {
            return "";
        }
        if (!S_ISREG(there.st_mode) && !S_ISLNK(there.st_mode)) {
            return name_ + " cannot be written: it is not an ordinary file";
        }
        return force_ ? "" : name_ + " exists already; choose another name, or set force to replace it";
    }

    /// Returns the number of bytes up to the end of the last whole line in a text.
    [[nodiscard]] static std::size_t whole_lines(std::string_view written) noexcept {
        const std::size_t end = written.rfind('\n');
        return end == std::string_view::npos ? 0 : end + 1;
    }

    /// Renames a NAME.part that no program is writing to a free name. Returns the reason if NAME.part cannot be renamed
    /// or may belong to another run.
    [[nodiscard]] std::string rename_interrupted() {
        const int there = ::open(part().c_str(), O_RDONLY | O_NONBLOCK | O_NOFOLLOW | O_CLOEXEC);
        if (there < 0) {
            return errno == ENOENT ? "" : part() + " cannot be replaced: " + detail::reason_of(errno);
        }
        std::string reason;
        struct stat about{};
        if (::flock(there, LOCK_EX | LOCK_NB) != 0) {
            reason =
                errno == EWOULDBLOCK
                    ? part() + " is being written by another run; choose another name, or wait for its end"
                    : part() +
                          " may belong to another run, because this file system has no locks; choose "
                          "another name, or rename it";
        } else if (detail::is_path_of(part(),
                                      there)) {  // false: another run has just renamed NAME.part
            if (::fstat(there, &about) == 0 && about.st_size == 0) {
                reason =
                    part() +
                    " is empty and may belong to a run that is starting; remove it if no run is starting";
            } else {
                reason = rename_to_first_free_name();
            }
        }
        ::close(there);
        return reason;
    }

    /// Renames NAME.part to the first free name of NAME.1.part, NAME.2.part, ... Returns the reason if that fails.
    [[nodiscard]] std::string rename_to_first_free_name() {
        int error = EEXIST;
        for (int k = 1; error == EEXIST; ++k) {
            interrupted_name_ = name_ + "." + std::to_string(k) + ".part";
            error = detail::rename_to_free_name(part(), interrupted_name_);
        }
        return error == 0
                   ? ""
                   : part() + " is an earlier recording and cannot be moved: " + detail::reason_of(error);
    }

    std::string name_;
    std::string interrupted_name_;
    bool force_ = false;
    int descriptor_ = -1;
    std::atomic<int> error_{0};
    off_t size_ = 0;
};

}  // namespace palpate
