// SPDX-License-Identifier: Apache-2.0
// Clock of a program under test, as a library that is loaded before all others (LD_PRELOAD).
//
// The clock shows virtual time. Time passes only while every thread of the program waits: for a deadline, for another
// thread or for a file. The next deadline is then reached, or the emulated device executes its next frame, if the
// variable PALPATE_EMULATOR names its socket. No result depends on the speed of the computer, and a wait takes no real
// time. Production code is unchanged: this library replaces the functions of the C library that read the clock or wait.
//
// Virtual time begins when the program locks its memory for a control loop, when libusb creates a timer, or when the
// program connects to a TCP socket or to the socket of an emulated drive. The timer fails, so that libusb computes its
// timeouts from this clock.
#include <dlfcn.h>
#include <linux/futex.h>
#include <linux/sockios.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstdarg>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace {

/// Virtual time or duration [ns].
using Time = std::int64_t;

constexpr Time second = 1'000'000'000;
constexpr Time never = std::numeric_limits<Time>::max();

/// Returns the function that this library replaces.
#define REAL(name) reinterpret_cast<decltype(&::name)>(::dlsym(RTLD_NEXT, #name))

/// Virtual time; `never` before it begins. The library must not allocate memory earlier, because a sanitizer calls it
/// while it starts.
constinit std::atomic<Time> now{never};

[[nodiscard]] bool is_virtual() {
    return now != never;
}

[[nodiscard]] Time of(const timespec& time) {
    return time.tv_sec * second + time.tv_nsec;
}

enum class State : std::uint8_t { Runs, Waits, Due };

/// A thread of the program, and its wait.
struct Thread {
    void* (*routine)(void*) = nullptr;
    void* argument = nullptr;
    pthread_t id{};
    State state = State::Runs;  ///< Due: the wait is over, and the thread continues when no other thread runs
    Time deadline = never;
    const void* word = nullptr;      ///< waits until another thread wakes the waiters of this address
    const Thread* joined = nullptr;  ///< waits for the end of this thread
    std::array<pollfd, 64> files{};  ///< waits for these files
    nfds_t count = 0;                ///< number of these files
    int alarm = -1;                  ///< file that ends a wait for files
};

/// Returns true if a thread runs, or if the file for which it waits is ready: the kernel then lets it continue.
[[nodiscard]] bool runs(Thread* thread) {
    return thread->state == State::Runs || REAL(poll)(thread->files.data(), thread->count, 0) > 0;
}

/// Virtual time of this program, and its threads.
class HostClock {
  public:
    /// The clock is never destroyed, because threads may use it until the process ends.
    static HostClock& get() {
        static HostClock& clock = *new HostClock;
        return clock;
    }

    /// Starts virtual time at the present time; the calling thread is its first thread.
    void start() {
        const std::lock_guard locked{mutex_};
        if (is_virtual()) {
            return;
        }
        std::thread{[] {
        }}.join();  // with the first thread, a sanitizer starts a thread that must not take part
        timespec present{};
        REAL(clock_gettime)(CLOCK_MONOTONIC, &present);
        if (const char* emulator = std::getenv("PALPATE_EMULATOR"); emulator != nullptr) {
            connect(emulator);
            next_frame_ = of(present);
        }
        (void)own();
        now = of(present);
    }

    int create(pthread_t* id, const pthread_attr_t* attributes, void* (*routine)(void*), void* argument) {
        const std::lock_guard locked{mutex_};
        Thread* thread = add();
        thread->routine = routine;
        thread->argument = argument;
        const int code = REAL(pthread_create)(id, attributes, &HostClock::run, thread);
        if (code == 0) {
            thread->id = *id;
        } else {
            remove(thread);
        }
        return code;
    }

    /// Waits until a thread that takes part ends.
    void join(pthread_t id) {
        std::unique_lock locked{mutex_};
        const auto joined = std::find_if(threads_.begin(), threads_.end(),
                                         [&](const Thread* each) { return each->id == id; });
        if (joined != threads_.end()) {
            Thread* self = own();
            self->joined = *joined;
            wait(self, never, locked);
        }
    }

    void sleep(Time deadline) {
        std::unique_lock locked{mutex_};
        wait(own(), deadline, locked);
    }

    /// Waits for wake(), if the number at the address is `known`. Returns 0 or the error number of a futex.
    int wait_on(const std::uint32_t* word, std::uint32_t known, Time deadline) {
        std::unique_lock locked{mutex_};
        if (__atomic_load_n(word, __ATOMIC_SEQ_CST) != known) {
            return EAGAIN;
        }
        Thread* self = own();
        self->word = word;
        wait(self, deadline, locked);
        return std::exchange(self->word, nullptr) == nullptr ? 0 : ETIMEDOUT;
    }

    /// Ends the waits of at most `most` threads for this address, and returns their number.
    int wake(const void* word, int most) {
        const std::lock_guard locked{mutex_};
        int woken = 0;
        for (Thread* thread : threads_) {
            if (thread->word == word && woken < most) {
                thread->word = nullptr;
                resume(*thread);
                ++woken;
            }
        }
        return woken;
    }

    int poll(pollfd* files, nfds_t count, Time deadline) {
        std::unique_lock locked{mutex_};
        Thread* self = own();
        if (self->alarm < 0) {
            self->alarm = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
        }
        std::copy_n(files, count, self->files.begin());
        self->files.at(count) = {self->alarm, POLLIN, 0};
        self->count = count + 1;
        self->deadline = deadline;
        stop(self, State::Waits);
        std::array polled = self->files;
        locked.unlock();
        const int code = REAL(poll)(polled.data(), count + 1, -1);
        const int error = errno;
        locked.lock();
        self->count = 0;
        self->state = State::Runs;
        eventfd_t rings = 0;
        const bool rang = ::eventfd_read(self->alarm, &rings) == 0 && polled.at(count).revents != 0;
        std::copy_n(polled.begin(), count, files);
        errno = error;
        return code < 0 ? code : code - (rang ? 1 : 0);
    }

  private:
    HostClock() {
        ::pthread_key_create(&own_, [](void* thread) {
            const std::lock_guard locked{get().mutex_};
            get().remove(static_cast<Thread*>(thread));
        });
    }

    /// Runs a new thread of the program. It allocates no memory, because a sanitizer does not know the thread yet.
    static void* run(void* thread) {
        ::pthread_setspecific(get().own_, thread);
        return static_cast<Thread*>(thread)->routine(static_cast<Thread*>(thread)->argument);
    }

    // The caller of these functions holds the mutex.

    void connect(const char* emulator) {
        emulator_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        // An empty address: the kernel chooses one
        ::bind(emulator_, reinterpret_cast<const sockaddr*>(&address), sizeof address.sun_family);
        std::strncpy(address.sun_path, emulator, sizeof address.sun_path - 1);
        ::connect(emulator_, reinterpret_cast<const sockaddr*>(&address), sizeof address);
    }

    Thread* add() {
        threads_.push_back(new Thread);
        return threads_.back();
    }

    /// Returns the calling thread, which takes part from its first wait on.
    Thread* own() {
        auto* self = static_cast<Thread*>(::pthread_getspecific(own_));
        if (self == nullptr) {
            self = add();
            self->id = ::pthread_self();
            ::pthread_setspecific(own_, self);
        }
        return self;
    }

    void remove(Thread* thread) {
        std::erase(threads_, thread);
        for (Thread* other : threads_) {
            if (other->joined == thread) {
                resume(*other);
            }
        }
        if (thread->alarm >= 0) {
            ::close(thread->alarm);
        }
        delete thread;
        pass_time();
        changed_.notify_all();
    }

    /// Waits until a deadline or the end of another wait, and until no other thread runs: the order of the threads
    /// does not depend on the scheduler.
    void wait(Thread* self, Time deadline, std::unique_lock<std::mutex>& locked) {
        self->deadline = deadline;
        stop(self, deadline > now ? State::Waits : State::Due);
        changed_.wait(locked, [&] {
            const auto next = std::find_if(threads_.begin(), threads_.end(),
                                           [](const Thread* each) { return each->state == State::Due; });
            return next != threads_.end() && *next == self &&
                   std::none_of(threads_.begin(), threads_.end(), runs);
        });
        self->state = State::Runs;
        self->joined = nullptr;
    }

    void stop(Thread* self, State state) {
        self->state = state;
        pass_time();
        changed_.notify_all();
    }

    /// Ends the wait of a thread.
    static void resume(Thread& thread) {
        if (thread.count == 0) {
            thread.state = State::Due;
        } else {
            ::eventfd_write(thread.alarm, 1);
        }
    }

    /// Passes time until a thread has a reason to continue.
    void pass_time() {
        const auto waits = [](Thread* thread) { return thread->state == State::Waits && !::runs(thread); };
        while (!threads_.empty() && std::all_of(threads_.begin(), threads_.end(), waits)) {
            Time next = next_frame_;
            for (const Thread* thread : threads_) {
                next = std::min(next, thread->deadline);
            }
            if (next == never) {
                return;  // all threads wait for files
            }
            now = next;
            if (next == next_frame_) {
                next_frame_ += frame();
            }
            for (Thread* thread : threads_) {
                if (thread->deadline <= now) {
                    resume(*thread);
                }
            }
        }
    }

    /// Orders a frame of the emulated device, and returns its duration.
    [[nodiscard]] Time frame() const {
        constexpr const char* order = "frame";
        ::send(emulator_, order, std::strlen(order), MSG_NOSIGNAL);
        std::array<char, 64> answer{};
        if (::recv(emulator_, answer.data(), answer.size() - 1, 0) <= 0) {
            ::_exit(125);  // without the emulator there is no time
        }
        return std::strtoll(answer.data(), nullptr, 10);
    }

    std::mutex mutex_;
    std::condition_variable changed_;
    std::vector<Thread*> threads_;
    pthread_key_t own_{};  ///< the calling thread
    Time next_frame_ = never;
    int emulator_ = -1;
};

[[nodiscard]] bool is_monotonic(clockid_t clock) {
    return clock == CLOCK_MONOTONIC || clock == CLOCK_MONOTONIC_RAW || clock == CLOCK_MONOTONIC_COARSE ||
           clock == CLOCK_BOOTTIME;
}

}  // namespace

extern "C" {

int timerfd_create(int /*clock*/, int /*flags*/) {
    HostClock::get().start();
    errno = ENOSYS;
    return -1;
}

int mlockall(int flags) {
    HostClock::get().start();
    return REAL(mlockall)(flags);
}

int clock_gettime(clockid_t clock, timespec* time) {
    if (!is_virtual() || !is_monotonic(clock)) {
        return REAL(clock_gettime)(clock, time);
    }
    const Time present = now;
    *time = {present / second, present % second};
    return 0;
}

int clock_nanosleep(clockid_t clock, int flags, const timespec* time, timespec* left) {
    if (!is_virtual() || !is_monotonic(clock)) {
        return REAL(clock_nanosleep)(clock, flags, time, left);
    }
    HostClock::get().sleep(of(*time) + (flags == TIMER_ABSTIME ? 0 : now.load()));
    return 0;
}

int nanosleep(const timespec* time, timespec* left) {
    if (!is_virtual()) {
        return REAL(nanosleep)(time, left);
    }
    HostClock::get().sleep(of(*time) + now);
    return 0;
}

int poll(pollfd* files, nfds_t count, int timeout_ms) {
    if (!is_virtual() || timeout_ms == 0) {
        return REAL(poll)(files, count, timeout_ms);
    }
    return HostClock::get().poll(files, count, timeout_ms < 0 ? never : now + timeout_ms * (second / 1000));
}

/// The socket of an emulated drive carries messages (SOCK_SEQPACKET); that of the service of an Inverse3 is TCP.
int connect(int file, const sockaddr* address, socklen_t size) {
    int type = 0;
    socklen_t length = sizeof type;
    if (::getsockopt(file, SOL_SOCKET, SO_TYPE, &type, &length) == 0 &&
        (type == SOCK_SEQPACKET || (type == SOCK_STREAM && address->sa_family != AF_UNIX))) {
        HostClock::get().start();
    }
    return REAL(connect)(file, address, size);
}

/// Waits for the answer of an emulated drive, a process of this machine whose answer takes no virtual time. The drive
/// takes a message from its socket only after it has sent the answers. If it has taken all messages and nothing can be
/// read, no answer follows, and the virtual time of the wait passes.
int ppoll(pollfd* files, nfds_t count, const timespec* timeout, const sigset_t* mask) {
    if (!is_virtual() || timeout == nullptr) {
        return REAL(ppoll)(files, count, timeout, mask);
    }
    constexpr timespec moment{0, second / 1000};
    constexpr timespec none{};
    const auto is_not_taken = [](const pollfd& file) {
        int bytes = 0;
        return ::ioctl(file.fd, SIOCOUTQ, &bytes) == 0 && bytes > 0;
    };
    int ready = 0;
    while (ready == 0 && std::any_of(files, files + count, is_not_taken)) {
        ready = REAL(ppoll)(files, count, &moment, mask);
    }
    ready = ready == 0 ? REAL(ppoll)(files, count, &none, mask) : ready;
    if (ready == 0) {
        HostClock::get().sleep(of(*timeout) + now);
    }
    return ready;
}

int pthread_create(pthread_t* id, const pthread_attr_t* attributes, void* (*routine)(void*), void* argument) {
    return is_virtual() ? HostClock::get().create(id, attributes, routine, argument)
                        : REAL(pthread_create)(id, attributes, routine, argument);
}

int pthread_join(pthread_t id, void** result) {
    if (is_virtual()) {
        HostClock::get().join(id);
    }
    return REAL(pthread_join)(id, result);
}

/// Replaces the waits for an address (futex); passes other system calls to the kernel.
long syscall(long number, ...) {
    std::array<long, 6> words{};
    va_list arguments;
    va_start(arguments, number);
    for (long& word : words) {
        word = va_arg(arguments, long);
    }
    va_end(arguments);
    const long operation = words[1] & FUTEX_CMD_MASK;
    if (number == SYS_futex && is_virtual()) {
        const auto* word = reinterpret_cast<const std::uint32_t*>(words[0]);
        const auto* time = reinterpret_cast<const timespec*>(words[3]);
        if (operation == FUTEX_WAIT || operation == FUTEX_WAIT_BITSET) {
            const Time start = operation == FUTEX_WAIT ? now.load() : 0;
            const int error = HostClock::get().wait_on(word, static_cast<std::uint32_t>(words[2]),
                                                       time == nullptr ? never : start + of(*time));
            errno = error;
            return error == 0 ? 0 : -1;
        }
        if (operation == FUTEX_WAKE) {
            return HostClock::get().wake(word, static_cast<int>(words[2]));
        }
    }
    return REAL(syscall)(number, words[0], words[1], words[2], words[3], words[4], words[5]);
}

}  // extern "C"
