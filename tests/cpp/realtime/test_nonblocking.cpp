// SPDX-License-Identifier: Apache-2.0
// Tests from outside that the loop does not allocate, lock, throw or make a system call, except for the clock.
//
// Functions of this program replace those of the libraries and count allocations, locks and exceptions. A filter of the
// kernel forbids system calls to the loop's thread; its SIGSYS states the number of the call. Each check is tested with
// a violation.
#include <dlfcn.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/rendering/direct.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/run/admittance_controller.hpp"
#include "palpate/run/session.hpp"
#include "palpate/simulation/simulated_device.hpp"
#include "palpate/simulation/simulated_display.hpp"
#include "support.hpp"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PALPATE_SANITIZED 1
#else
#define PALPATE_SANITIZED 0
#endif

namespace {

/// True in the thread of the control loop while the loop executes a tick.
thread_local bool watched = false;

std::atomic<int> allocations{0};
std::atomic<int> locks{0};
std::atomic<int> exceptions{0};

// Not called in builds with sanitizers, because sanitizers replace the same library functions as this test.
[[maybe_unused]] void count_if_watched(std::atomic<int>& counter) {
    if (watched) {
        counter.fetch_add(1, std::memory_order_relaxed);
    }
}

}  // namespace

#if !PALPATE_SANITIZED
extern "C" {

void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void __libc_free(void* memory);

void* malloc(std::size_t size) {
    count_if_watched(allocations);
    return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
    count_if_watched(allocations);
    return __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) {
    count_if_watched(allocations);
    return __libc_realloc(old, size);
}
void free(void* memory) {
    if (memory != nullptr) {
        count_if_watched(allocations);
    }
    __libc_free(memory);
}

int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
    using Lock = int (*)(pthread_mutex_t*);
    static const auto lock = reinterpret_cast<Lock>(dlsym(RTLD_NEXT, "pthread_mutex_lock"));
    count_if_watched(locks);
    return lock(mutex);
}

void* __cxa_allocate_exception(std::size_t size) noexcept {
    using Allocate = void* (*)(std::size_t);
    static const auto allocate = reinterpret_cast<Allocate>(dlsym(RTLD_NEXT, "__cxa_allocate_exception"));
    count_if_watched(exceptions);
    return allocate(size);
}

}  // extern "C"
#endif

namespace palpate {
namespace {

std::mutex a_mutex;
std::atomic<void*> escaped{nullptr};

/// A simulated device that does one action that is forbidden in a real-time loop, in the fifth exchange of position and
/// force.
template <class ForbiddenAction, class Simulated = SimulatedDevice>
class FaultyHandle {
  public:
    explicit FaultyHandle(ForbiddenAction action, Simulated device = Simulated{DeviceProfile{}})
        : device_{std::move(device)}, action_{action} {}
    Opened open() { return device_.open(); }
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        if (++exchanges_ == 5) {
            action_();
        }
        return device_.exchange(command);
    }
    void close() noexcept { device_.close(); }

  private:
    Simulated device_;
    ForbiddenAction action_;
    int exchanges_ = 0;
};

constexpr auto nothing = [] {};
constexpr auto allocates = [] {
    void* memory = std::malloc(16);
    escaped = memory;
    std::free(memory);
};
constexpr auto locks_a_mutex = [] { const std::lock_guard guard{a_mutex}; };
constexpr auto throws = [] {
    try {
        throw std::runtime_error{"caught at once"};
    } catch (const std::runtime_error&) {
    }
};
constexpr auto calls_the_system = [] { (void)syscall(SYS_getppid); };

/// Passes each record to the real recorder, and starts counting forbidden actions at the first tick of the control
/// loop.
template <class Recorder>
struct WatchedSink {
    Recorder& recorder;
    LastRecords<TickRecord>& last;
    void push(const TickRecord& record) noexcept {
        recorder.push(record);
        last.push(record);
    }
};

struct Counts {
    int allocations = 0;
    int locks = 0;
    int exceptions = 0;
    std::uint64_t ticks = 0;
};

ForceModel model() {
    test::Random random{7};
    return {test::random_network(random, 16), test::unit_domain()};
}

ForceModel hysteresis_model() {
    test::Random random{7};
    const NetworkParameters network = test::random_network(random, 16);
    return {network, {std::vector<double>(16, 0.0), 0.0, 0.1}, test::unit_domain(), 0.01};
}

ForceModel velocity_model() {
    test::Random random{7};
    return ForceModel::of_velocity(test::random_network(random, 16, 2),
                                   {{0.0, -1.0}, {1.0, 1.0}, {}, {}, std::nullopt});
}

constexpr double watched_rate_hz = 10'000.0;

/// Runs the real control loop at 10 kHz with its real recorder. `before` runs in the loop's thread before the loop
/// starts, `after` runs in the same thread after the loop ends.
template <class Control, class Before, class After>
Counts watch_loop(Control& controller, Before before, After after) {
    LoopSettings settings;
    settings.rate_hz = watched_rate_hz;
    settings.duration_s = 0.1;
    settings.lowest_rate_share = 0.0;
    Counts counts;
    RecordSinks sinks;
    using Recorder = FlightRecorder<TickRecord, RecordSinks>;
    Recorder recorder{sinks, 4096, std::chrono::milliseconds{5}};
    LastRecords<TickRecord> last{100};
    LoopProgress progress;
    const auto report = std::make_unique<LoopReport>();
    const std::atomic<bool> stop_requested{false};
    std::atomic<bool> over{false};
    std::thread loop{[&] {
        Periodic clock{100'000};
        WatchedSink<Recorder> sink{recorder, last};
        allocations = locks = exceptions = 0;
        before();
        watched = true;
        run_loop(controller, settings, clock, stop_requested, sink, progress, *report);
        watched = false;
        over.store(true);
        after();
    }};
    while (!over.load()) {
        std::this_thread::sleep_for(std::chrono::milliseconds{1});
    }
    counts = {allocations, locks, exceptions, report->ticks()};
    if constexpr (std::is_same_v<After, std::remove_const_t<decltype(nothing)>>) {
        loop.join();
    } else {
        // The system-call filter of this thread allows no other way to end the thread.
        _exit(counts.ticks > 0 ? 0 : 1);
    }
    return counts;
}

template <class ForbiddenAction, class Before, class After>
Counts run_watched(const ForceModel& rendered, StructureKind kind, ForbiddenAction action, Before before,
                   After after, int predict = 0) {
    Scheme scheme;
    scheme.structure = kind;
    scheme.predict = predict;
    FaultyHandle<ForbiddenAction> device{action};
    EXPECT_TRUE(device.open());
    Controller controller{
        device, make_structure(rendered, scheme, 1.0 / watched_rate_hz, GuardSettings{}.force_limit),
        guards_of(GuardSettings{}, rendered, scheme, 1.0 / watched_rate_hz)};
    return watch_loop(controller, before, after);
}

/// Runs the loop of an admittance display.
template <class ForbiddenAction, class Before, class After>
Counts run_watched_pedal(StructureKind kind, ForbiddenAction action, Before before, After after) {
    Scheme scheme;
    scheme.structure = kind;
    scheme.coupling = {0.0, 0.0};
    DeviceProfile profile;
    profile.period_s = 1.0 / watched_rate_hz;
    profile.admittance = AdmittanceDisplay{.hand_stiffness = 10.0, .servo_bandwidth_hz = 50.0};
    FaultyHandle device{action, SimulatedPedal<Hand>{profile}};
    EXPECT_TRUE(device.open());
    AdmittanceController controller{
        device,
        {make_structure(model(), scheme, profile.period_s, GuardSettings{}.force_limit), profile},
        Guards{},
        profile.force_limit,
        1.0};
    return watch_loop(controller, before, after);
}

template <class ForbiddenAction>
Counts counted(ForbiddenAction action, StructureKind kind = StructureKind::Massless) {
    return run_watched(model(), kind, action, nothing, nothing);
}

#define SKIP_UNDER_SANITIZERS()                                     \
    if (PALPATE_SANITIZED) {                                        \
        GTEST_SKIP() << "the sanitizer itself allocates and calls"; \
    }

TEST(RealTimePath, NoStructureAllocatesLocksOrThrows) {
    SKIP_UNDER_SANITIZERS();
    EXPECT_EQ(run_watched(velocity_model(), StructureKind::Direct, nothing, nothing, nothing).allocations, 0);
    for (const ForceModel& rendered : {model(), hysteresis_model()}) {
        const Counts predicted =
            run_watched(rendered, StructureKind::Direct, nothing, nothing, nothing, most_prediction_taps);
        EXPECT_GT(predicted.ticks, 0U);
        EXPECT_EQ(predicted.allocations + predicted.locks + predicted.exceptions, 0);
        for (int kind = 0; kind < 4; ++kind) {
            const Counts counts =
                run_watched(rendered, static_cast<StructureKind>(kind), nothing, nothing, nothing);
            EXPECT_GT(counts.ticks, 0U);
            EXPECT_EQ(counts.allocations, 0) << structure_names[static_cast<std::size_t>(kind)];
            EXPECT_EQ(counts.locks, 0) << structure_names[static_cast<std::size_t>(kind)];
            EXPECT_EQ(counts.exceptions, 0) << structure_names[static_cast<std::size_t>(kind)];
        }
    }
}

TEST(RealTimePath, NoPedalAllocatesLocksOrThrows) {
    SKIP_UNDER_SANITIZERS();
    for (const StructureKind kind :
         {StructureKind::Implicit, StructureKind::Explicit, StructureKind::EnergyConsistent}) {
        const Counts counts = run_watched_pedal(kind, nothing, nothing, nothing);
        EXPECT_GT(counts.ticks, 0U);
        EXPECT_EQ(counts.allocations + counts.locks + counts.exceptions, 0) << static_cast<int>(kind);
    }
    EXPECT_EQ(run_watched_pedal(StructureKind::Implicit, allocates, nothing, nothing).allocations, 2);
}

TEST(RealTimePath, CountersDetectAllocationsLocksAndExceptions) {
    SKIP_UNDER_SANITIZERS();
    EXPECT_EQ(counted(allocates).allocations, 2);
    EXPECT_EQ(counted(locks_a_mutex).locks, 1);
    EXPECT_GE(counted(throws).exceptions, 1);
}

/// Shared memory in which a child process stores the number of the forbidden system call that ended it.
int* shared_call_number() {
    static auto* const number = static_cast<int*>(
        mmap(nullptr, sizeof(int), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
    return number;
}

void report_system_call(int /*signal*/, siginfo_t* info, void* /*context*/) {
    *shared_call_number() = info->si_syscall;
    _exit(99);
}

/// Restricts the calling thread to three system calls: sleeping until a deadline, reading the clock and ending the
/// process.
void forbid_system_calls() {
    struct sigaction action{};
    action.sa_sigaction = report_system_call;
    action.sa_flags = SA_SIGINFO;
    sigaction(SIGSYS, &action, nullptr);
    constexpr auto allow = [](unsigned number) {
        return std::array<sock_filter, 2>{
            {{BPF_JMP | BPF_JEQ | BPF_K, 0, 1, number}, {BPF_RET | BPF_K, 0, 0, SECCOMP_RET_ALLOW}}};
    };
    const auto sleep = allow(SYS_clock_nanosleep);
    const auto clock = allow(SYS_clock_gettime);
    const auto end = allow(SYS_exit_group);
    std::array<sock_filter, 8> filter{{{BPF_LD | BPF_W | BPF_ABS, 0, 0, offsetof(seccomp_data, nr)},
                                       sleep[0],
                                       sleep[1],
                                       clock[0],
                                       clock[1],
                                       end[0],
                                       end[1],
                                       {BPF_RET | BPF_K, 0, 0, SECCOMP_RET_TRAP}}};
    const sock_fprog program{static_cast<unsigned short>(filter.size()), filter.data()};
    prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    ASSERT_EQ(prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program), 0)
        << "this kernel has no seccomp filters";
}

void sleep_until_killed() {
    Periodic clock{1'000'000'000};
    for (clock.start();;) {
        (void)clock.wait();
    }
}

/// Returns the number of the system call at which the kernel ended the loop; 0 if the loop ran to its end.
template <class ForbiddenAction>
int system_call_in_the_loop(ForbiddenAction action, StructureKind kind, const ForceModel& rendered) {
    *shared_call_number() = 0;
    const pid_t child = fork();
    if (child == 0) {
        (void)run_watched(rendered, kind, action, forbid_system_calls, sleep_until_killed);
        _exit(2);
    }
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && (WEXITSTATUS(status) == 0 || WEXITSTATUS(status) == 99))
        << "the child ended with status " << status;
    return WEXITSTATUS(status) == 99 ? *shared_call_number() : 0;
}

TEST(RealTimePath, CallsTheSystemOnlyForTheClock) {
    SKIP_UNDER_SANITIZERS();
    for (const ForceModel& rendered : {model(), hysteresis_model()}) {
        for (int kind = 0; kind < 4; ++kind) {
            EXPECT_EQ(system_call_in_the_loop(nothing, static_cast<StructureKind>(kind), rendered), 0)
                << "system call in the loop of " << structure_names[static_cast<std::size_t>(kind)];
        }
    }
}

TEST(RealTimePath, FilterReportsTheSystemCallItCaught) {
    SKIP_UNDER_SANITIZERS();
    EXPECT_EQ(system_call_in_the_loop(calls_the_system, StructureKind::Massless, model()), SYS_getppid);
}

}  // namespace
}  // namespace palpate
