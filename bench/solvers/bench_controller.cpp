// SPDX-License-Identifier: Apache-2.0
// Measures a whole tick of the controller: check of the reading, force with the default solver, force and slew limit.
// The device plays back a recorded motion and takes no time. Counters are the median and the 99.9th percentile of
// single ticks, minus the time of the clock.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <vector>

#include <benchmark/benchmark.h>

#include "palpate/guard/guard_settings.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/run/controller.hpp"
#include "scene.hpp"

namespace {

/// Device whose handle position repeats a stored motion.
class Playback {
  public:
    explicit Playback(std::vector<double> motion) : motion_{std::move(motion)} {}

    [[nodiscard]] palpate::Opened open() { return {}; }
    [[nodiscard]] palpate::Reading exchange(const palpate::Command& command) noexcept {
        palpate::Reading reading;
        reading.position = motion_[next_];
        reading.applied = command.force;
        reading.sequence = ++sequence_;
        next_ = next_ + 1 == motion_.size() ? 0 : next_ + 1;
        return reading;
    }
    void close() noexcept {}

  private:
    std::vector<double> motion_;
    std::size_t next_ = 0;
    std::uint64_t sequence_ = 0;
};

using Clock = std::chrono::steady_clock;

/// Returns the sorted durations of many calls of the function `work` [ns].
template <class Work>
std::vector<double> durations(Work work) {
    constexpr int count = 200'000;
    std::vector<double> durations;
    durations.reserve(count);
    for (int k = 0; k < count; ++k) {
        const Clock::time_point before = Clock::now();
        work();
        durations.push_back(std::chrono::duration<double, std::nano>(Clock::now() - before).count());
    }
    std::sort(durations.begin(), durations.end());
    return durations;
}

double quantile(const std::vector<double>& sorted, double share) {
    return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
}

void tick(benchmark::State& state, const palpate::ForceModel& model, palpate::StructureKind kind,
          bool compensated = false) {
    palpate::Scheme scheme;
    scheme.structure = kind;
    scheme.compensated = compensated;
    scheme.play_radius = model.hysteresis() != nullptr ? 0.005 : 0.0;
    if (palpate::holds_line(kind)) {
        scheme.line = palpate::HeldSlope{palpate::SlopeRule::Steepest, 1e6, 0.0, 0.01};
    }
    Playback device{palpate::bench::hand_motion(4000)};
    palpate::GuardSettings settings;
    settings.force_limit = 50.0;
    palpate::Controller controller{device, palpate::make_structure(model, scheme, 1e-3, 50.0),
                                   palpate::Guards{.reading = palpate::reading_guard(settings, 1e-3),
                                                   .limit = palpate::force_limit(settings),
                                                   .ramp = palpate::force_ramp(settings, 1e-3),
                                                   .slew = palpate::slew_limit(settings, 1e-3)}};
    (void)controller.start();
    for (auto _ : state) {
        benchmark::DoNotOptimize(controller.tick());
    }
    const double clock = quantile(durations([] {}), 0.5);
    const std::vector<double> ticks = durations([&] { benchmark::DoNotOptimize(controller.tick()); });
    state.counters["p50_ns"] = quantile(ticks, 0.5) - clock;
    state.counters["p999_ns"] = quantile(ticks, 0.999) - clock;
    int wrong = 0;
    for (int k = 0; k < 4000; ++k) {
        const palpate::Tick one = controller.tick();
        wrong += one.status == palpate::Status::Ok && std::isfinite(one.command.force) ? 0 : 1;
    }
    if (wrong > 0) {
        state.SkipWithError("not every tick was Ok");
    }
}

palpate::ForceModel spring_wall() {
    const auto network = palpate::bench::spring_and_wall(16);
    return {network.parameters(), network.domain()};
}

palpate::ForceModel with_hysteresis() {
    const auto network = palpate::bench::spring_and_wall(16);
    return {network.parameters(), {std::vector<double>(16, 0.002), 0.0, 0.2}, network.domain(), 0.005};
}

palpate::ForceModel with_memory() {
    palpate::MemoryParameters memory;
    memory.ratio = palpate::NetworkParameters{1, {3.0, 5.0}, {0.2, 0.7}, {0.2, -0.2}, {0.0}, 1.0};
    memory.stiffness = {1.0, 2.0, 1.0, 0.5};
    memory.time_constant_s = {0.1, 0.5, 2.0, 10.0};
    return spring_wall().with_memory(memory);
}

}  // namespace

BENCHMARK_CAPTURE(tick, direct, spring_wall(), palpate::StructureKind::Direct);
BENCHMARK_CAPTURE(tick, direct_memory, with_memory(), palpate::StructureKind::Direct);
BENCHMARK_CAPTURE(tick, tangent, spring_wall(), palpate::StructureKind::Tangent);
BENCHMARK_CAPTURE(tick, massless, spring_wall(), palpate::StructureKind::Massless);
BENCHMARK_CAPTURE(tick, massless_compensated, spring_wall(), palpate::StructureKind::Massless, true);
BENCHMARK_CAPTURE(tick, implicit, spring_wall(), palpate::StructureKind::Implicit);
BENCHMARK_CAPTURE(tick, explicit, spring_wall(), palpate::StructureKind::Explicit);
BENCHMARK_CAPTURE(tick, massless_hysteresis, with_hysteresis(), palpate::StructureKind::Massless);
BENCHMARK_CAPTURE(tick, implicit_hysteresis, with_hysteresis(), palpate::StructureKind::Implicit);

BENCHMARK_MAIN();
