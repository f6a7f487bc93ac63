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

/// Finds the file to which a chain of symbolic links leads; the file may be missing. Returns the reason if a link must
/// not be followed, otherwise "". In a folder that all users can write, such as /tmp, another user can place a link to
/// a file of this user. There only a link of this user or of the owner of the folder is followed, as on systems with
/// the setting fs.protected_symlinks.
[[nodiscard]] inline std::string follow_links(const std::string& name, std::string& target) {
    constexpr int most_links = 40;
    constexpr mode_t shared = S_ISVTX | S_IWOTH;
    std::filesystem::path file{name};
    std::error_code error;
    for (int links = 0; std::filesystem::is_symlink(file, error); ++links) {
        const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
        struct stat link{};
        struct stat parent{};
        if (links == most_links || ::lstat(file.c_str(), &link) != 0 ||
            ::stat(folder.c_str(), &parent) != 0) {
            return name + " cannot be written: " + reason_of(ELOOP);
        }
        if ((parent.st_mode & shared) == shared && link.st_uid != ::geteuid() &&
            link.st_uid != parent.st_uid) {
            return name + " cannot be written: it is a symbolic link of another user in a shared folder";
        }
        file = folder / std::filesystem::read_symlink(file, error);
    }
    target = file;
    return "";
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
    /// NAME is a symbolic link, the target of the link is replaced. The new file has the mode of the replaced one.
    [[nodiscard]] std::string open(const std::string& name, bool force = false) {
        force_ = force;
        name_ = name;
        if (force) {
            if (std::string reason = detail::follow_links(name, name_); !reason.empty()) {
                return reason;
            }
            if (std::error_code error; name_ != name && !std::filesystem::exists(name_, error)) {
                return name + " cannot be written: it is a symbolic link to a missing file";
            }
        }
        if (std::string reason = name_conflict(); !reason.empty()) {
            return reason;
        }
        if (std::string reason = create_part(); !reason.empty()) {
            return reason;
        }
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

    /// Overwrites a part of the file, from byte `place` on, with a text of the same length as that part. If this write
    /// fails, the file keeps its old text, and finish() reports the reason.
    void overwrite(off_t place, std::string_view text) noexcept {
        if (descriptor_ >= 0 && place + static_cast<off_t>(text.size()) <= size_ &&
            ::pwrite(descriptor_, text.data(), text.size(), place) != static_cast<ssize_t>(text.size())) {
            unsaved_ = errno != 0 ? errno : EIO;
        }
    }

    /// Writes all data to the disk and renames NAME.part to NAME. Returns "", or the reason why the file could not be
    /// renamed; the recording then keeps the name NAME.part.
    [[nodiscard]] std::string finish() {
        // Some network file systems have no fsync: EINVAL, ENOTSUP.
        if (::fsync(descriptor_) != 0 && errno != EINVAL && errno != ENOTSUP) {
            unsaved_ = errno;
        }
        std::string reason;
        if (unsaved_ != 0) {
            reason = "the recording keeps the name " + part() +
                     ", because it is incomplete on the disk: " + detail::reason_of(unsaved_);
        } else if (!detail::is_path_of(part(), descriptor_)) {
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
    /// Creates and locks NAME.part. Returns the reason if that is not possible.
    ///
    /// The run that holds the lock of an empty file owns it, also if another run has just created the file.
    [[nodiscard]] std::string create_part() {
        // Between two tries another run can finish its recording, or rename an interrupted one.
        for (int tries = 3; tries > 0; --tries) {
            constexpr int flags = O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK;
            descriptor_ = ::open(part().c_str(), O_WRONLY | O_CREAT | O_EXCL | flags, 0666);
            const bool is_new = descriptor_ >= 0;
            if (!is_new && errno != EEXIST) {
                return name_ + " cannot be written: " + detail::reason_of(errno);
            }
            if (!is_new) {
                descriptor_ = ::open(part().c_str(), O_WRONLY | flags);
            }
            const bool is_writable = descriptor_ >= 0;
            if (!is_writable) {  // an interrupted recording can be read-only
                descriptor_ = ::open(part().c_str(), O_RDONLY | flags);
            }
            if (descriptor_ < 0 && errno != ENOENT) {
                return part() + " cannot be replaced: " + detail::reason_of(errno);
            }
            std::string reason = descriptor_ < 0 ? "" : owned(is_new, is_writable);
            if (descriptor_ >= 0 || !reason.empty()) {
                return reason;
            }
        }
        return name_ + " cannot be written: other runs create " + part() + " again and again";
    }

    /// Locks the open NAME.part. Closes it if it belongs to another run, and returns the reason, or if it has been
    /// moved: an interrupted recording is renamed to a free name here.
    [[nodiscard]] std::string owned(bool is_new, bool is_writable) {
        std::string reason;
        struct stat about{};
        // On a file system without locks no other program writes a new file either, because of O_EXCL.
        if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && (errno == EWOULDBLOCK || !is_new)) {
            reason =
                errno == EWOULDBLOCK
                    ? part() + " is being written by another run; choose another name, or wait for its end"
                    : part() +
                          " may belong to another run, because this file system has no locks; choose "
                          "another name, or rename it";
        } else if (detail::is_path_of(part(), descriptor_) && ::fstat(descriptor_, &about) == 0) {
            if (is_writable && about.st_size == 0 && S_ISREG(about.st_mode)) {
                copy_mode();
                return "";
            }
            reason = rename_to_first_free_name();
        }
        close();
        return reason;
    }

    /// Gives the new file the owner and the mode of the file that it will replace.
    void copy_mode() const noexcept {
        struct stat replaced{};
        if (::stat(name_.c_str(), &replaced) == 0) {
            (void)!::fchown(descriptor_, replaced.st_uid, replaced.st_gid);  // only root may change the owner
            (void)!::fchmod(descriptor_, replaced.st_mode & 07777U);
        }
    }

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
        return force_ ? "" : name_ + " exists already; choose another name, or replace it with --force";
    }

    /// Returns the number of bytes up to the end of the last whole line in a text.
    [[nodiscard]] static std::size_t whole_lines(std::string_view written) noexcept {
        const std::size_t end = written.rfind('\n');
        return end == std::string_view::npos ? 0 : end + 1;
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
    int unsaved_ = 0;  ///< error number of data that did not reach the disk; 0 without an error
    off_t size_ = 0;
};

}  // namespace palpate
