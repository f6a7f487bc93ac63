// SPDX-License-Identifier: Apache-2.0
// Random scenes with random faults, rendered in virtual time with all promises checked.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <ostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "invariants.hpp"
#include "limits/hands.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/rendering/scale.hpp"
#include "palpate/run/detail/render.hpp"
#include "palpate/simulation/faulty_device.hpp"
#include "palpate/simulation/simulated_device.hpp"
#include "simulation/scenes.hpp"

namespace palpate::test {

/// A hand of any kind.
struct AnyHand {
    std::variant<PassiveHand, ShakingHand, GreedyHand, Hand> hand;
    [[nodiscard]] Grip grip(double time, const Motion& handle) noexcept {
        return std::visit([&](auto& one) { return one.grip(time, handle); }, hand);
    }
};

inline AnyHand random_hand(Random& random, const Scene& scene) {
    const double stiffness =
        std::max(1.0, scene.model.slope_bounds().largest()) * std::exp(uniform(random, -3.0, 3.0));
    switch (random() % 4) {
        case 0:
            return {PassiveHand{stiffness, std::exp(uniform(random, -8.0, 0.0)),
                                random() % 2 == 0 ? 0.0 : std::exp(uniform(random, -8.0, 2.0)),
                                uniform(random, -0.1, 1.1)}};
        case 1:
            return {ShakingHand{stiffness, scene.steepest, std::exp(uniform(random, -6.0, -1.0)),
                                random() % 2 == 0 ? 1.0 : uniform(random, 0.05, 1.0), scene.device.period_s}};
        case 2:
            return {GreedyHand{std::exp(uniform(random, -3.0, 4.0)), scene.steepest,
                               std::exp(uniform(random, -6.0, -1.0)), uniform(random, 0.05, 5.0)}};
        default:
            return {Hand{stiffness, 1e-3 * stiffness, uniform(random, -0.1, 0.5), uniform(random, 0.5, 1.1),
                         uniform(random, 0.5, 20.0)}};
    }
}

/// Returns a random scene with a finite force limit, and its certificate.
inline std::pair<Scene, Certificate> random_scene(Random& random) {
    for (;;) {
        const double reserve = 1.0 + 1e-9 + (random() % 2 == 0 ? 0.0 : uniform(random, 0.0, 1.0));
        Scene scene = random() % 2 == 0   ? random_certified_scene(random, reserve)
                      : random() % 2 == 0 ? random_scene_of_velocity(random)
                                          : random_scene_of_memory(random);
        if (random() % 8 == 0) {  // a scheme without proof
            scene.scheme.structure = static_cast<StructureKind>(random() % structure_names.size());
        }
        DeviceProfile& device = scene.device;
        device.period_s = 1e-9 * std::round(1e9 * device.period_s);  // the unit of the clock
        device.jitter_s = random() % 2 == 0 ? 0.0 : uniform(random, 0.0, 0.5) * device.period_s;
        device.delay_s = device.period_s *
                         (random() % 2 == 0 ? static_cast<double>(random() % 3) : uniform(random, 0.0, 3.0));
        device.force_limit = std::exp(uniform(random, -3.0, 3.0));
        try {
            validate(scene.scheme, scene.model, scene.device.period_s);
        } catch (const std::invalid_argument&) {
            continue;
        }
        if (const auto enough = device_at_its_bound(scene.model, scene.scheme, scene.device, reserve)) {
            scene.device = *enough;
        }
        return {scene, certify(scene.model, scene.scheme, scene.device)};
    }
}

inline std::string name_of_scene(const Scene& scene, bool certified) {
    const ForceModel& model = scene.model;
    return std::string(name_of(scene.scheme.structure)) +
           (model.memory() != nullptr       ? " memory"
            : model.velocity() != nullptr   ? " velocity"
            : model.hysteresis() != nullptr ? " hysteresis"
                                            : " position") +
           (scene.scheme.compensated ? " compensated" : "") + (scene.scheme.predict > 0 ? " predicted" : "") +
           (certified ? "" : ", uncertified");
}

/// Counters of a campaign.
struct Totals {
    std::uint64_t scenes = 0;
    std::uint64_t runs = 0;
    std::uint64_t ticks = 0;
    std::map<std::string, std::uint64_t> ticks_by_scene;
    std::array<std::uint64_t, fault_names.size()> faults{};
    std::uint64_t clock_faults = 0;
    std::array<std::uint64_t, status_texts.size()> by_status{};
    std::array<std::uint64_t, 6> by_exit{};
    Extremes extremes;
};

/// Faults of one run of `ticks` ticks, also none.
inline std::vector<Fault> random_faults(Random& random, std::uint64_t ticks) {
    std::vector<Fault> faults;
    for (std::uint64_t left = random() % 6, at = 0; left > 0; --left) {
        at += 1 + random() % (ticks / 3);
        if (at >= ticks) {
            break;
        }
        const auto kind = static_cast<FaultKind>(random() % fault_names.size());
        const std::uint64_t samples = kind == FaultKind::Frozen ? random() % 120 : 1 + random() % 8;
        faults.push_back({kind, at, samples});
        at += samples;
    }
    return faults;
}

inline std::vector<ClockFault> random_clock_faults(Random& random, std::uint64_t ticks, double period_s,
                                                   Totals& totals) {
    std::vector<ClockFault> faults;
    if (random() % 4 == 0) {
        const auto period = 1e9 * period_s;
        const auto time = [&](double least, double most) {
            return static_cast<Nanoseconds>(period * std::exp(uniform(random, least, most)));
        };
        const std::uint64_t tick = random() % ticks;
        switch (random() % 3) {
            case 0:
                faults.push_back({tick, time(-7.0, 3.0), 0});
                break;
            case 1:
                faults.push_back({tick, 0, time(-2.0, 12.0)});
                break;
            default:
                faults.push_back({tick, 0, -time(-2.0, 12.0)});
        }
        ++totals.clock_faults;
    }
    return faults;
}

/// Renders one random scene in several runs. Returns the first promise that did not hold, or "".
inline std::string run_scene(std::uint64_t seed, Totals& totals) {
    Random random{seed};
    const auto drawn = random_scene(random);
    // References, because clang before version 16 cannot capture the names of a structured binding.
    const auto& scene = drawn.first;
    const auto& certificate = drawn.second;
    const double period_s = scene.device.period_s;
    const std::string name = name_of_scene(scene, certificate.certified());
    std::string broken;
    const AnyStructure structure =
        make_structure(scene.model, scene.scheme, period_s, scene.device.force_limit);
    constexpr int runs = 25;
    for (int run = 0; run < runs && broken.empty(); ++run) {
        GuardSettings guards = guards_for(scale_of(scene.model, false), scene.device);
        guards.ramp_s = random() % 2 == 0 ? 0.0 : uniform(random, 0.0, 200.0 * period_s);
        LoopSettings loop;
        loop.rate_hz = 1.0 / period_s;
        loop.lowest_rate_share = random() % 2 == 0 ? 0.0 : 0.8;
        loop.tolerated = random() % 8;
        const bool follows_certificate = certificate.certified() && random() % 2 == 0;
        if (follows_certificate) {
            palpate::detail::apply_certificate(certificate, guards, loop);
        }
        const std::uint64_t ticks = 50 + random() % 8000;
        loop.duration_s = static_cast<double>(ticks) * period_s;
        validate(loop);
        validate(guards);
        const double largest_step = guards.largest_speed * period_s;
        const double jump =
            (random() % 2 == 0 ? -1.0 : 1.0) * largest_step * std::exp(uniform(random, -3.0, 3.0));
        const std::vector<Fault> faults = random_faults(random, ticks);
        Faulty device{
            SimulatedHandle<AnyHand, Midpoint>{scene.device, random_hand(random, scene), 2, scene.start},
            faults, jump};
        if (const Opened opened = device.open(); !opened) {
            broken = opened.reason;
            break;
        }
        Invariants invariants{guards, loop, scene.device};
        const LoopReport report =
            run_checked(structure, std::move(device), guards_of(guards, scene.model, scene.scheme, period_s),
                        loop, period_s, random_clock_faults(random, ticks, period_s, totals), invariants,
                        [](const TickRecord&) {});
        broken = invariants.broken();
        // A certificate without delay proves that the account never acts, except with the energy of the start ramp
        const auto limited = report.ticks_by_status[static_cast<std::size_t>(Status::EnergyLimited)];
        if (broken.empty() && follows_certificate && faults.empty() && scene.device.delay_s == 0.0 &&
            guards.ramp_s == 0.0 && limited > 0) {
            broken = "the energy account limits forces of a certified run";
        }
        if (!broken.empty()) {
            broken += ", run " + std::to_string(run) + (follows_certificate ? ", certified" : "");
        }
        for (const Fault& fault : faults) {
            totals.faults[static_cast<std::size_t>(fault.kind)] +=
                fault.exchange < invariants.ticks() ? 1 : 0;
        }
        ++totals.runs;
        totals.ticks += invariants.ticks();
        totals.ticks_by_scene[name] += invariants.ticks();
        totals.extremes.add(invariants.extremes());
        ++totals.by_exit.at(static_cast<std::size_t>(report.exit_reason));
        for (std::size_t k = 0; k < status_texts.size(); ++k) {
            totals.by_status[k] += report.ticks_by_status[k];
        }
    }
    ++totals.scenes;
    if (!broken.empty()) {
        std::ostringstream text;
        text << broken << ": " << name << ": " << scene << ", force limit " << scene.device.force_limit;
        broken = text.str();
    }
    return broken;
}

inline std::ostream& operator<<(std::ostream& out, const Totals& totals) {
    out << totals.scenes << " scenes, " << totals.runs << " runs, " << totals.ticks << " ticks\n";
    for (const auto& [name, ticks] : totals.ticks_by_scene) {
        out << "  " << name << ": " << ticks << " ticks\n";
    }
    out << "faults:";
    for (std::size_t k = 0; k < fault_names.size(); ++k) {
        out << " " << fault_names[k] << " " << totals.faults[k];
    }
    out << ", clock " << totals.clock_faults << "\nstatus:";
    for (std::size_t k = 0; k < status_texts.size(); ++k) {
        out << " " << status_texts[k].word << " " << totals.by_status[k];
    }
    out << "\nexits: time up " << totals.by_exit[0] << ", guard " << totals.by_exit[2] << ", device fault "
        << totals.by_exit[3] << ", rate " << totals.by_exit[4] << ", certificate " << totals.by_exit[5];
    return out << "\nlargest force " << totals.extremes.force << " of the limit, slew "
               << totals.extremes.slew << " of the limit, energy taken " << totals.extremes.taken
               << " of E0, " << totals.extremes.evaluations << " evaluations in a tick\n";
}

}  // namespace palpate::test
