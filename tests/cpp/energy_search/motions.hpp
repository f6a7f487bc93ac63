// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "../support.hpp"

namespace palpate::energy_search {

/// A motion of the handle: from rest at `start` to `centre`, then a repeated wave. The wave is a list of positions,
/// one for each sample, or a sum of sines.
struct Motion {
    double centre = 0.0;
    double size = 1.0;
    double period = 2.0;  ///< number of samples after which the sum of sines repeats
    bool sines = false;
    /// Handle positions of one repetition of the motion, or for a sum of sines the cosine and sine amplitude of each
    /// harmonic.
    std::vector<double> shape;
    /// Position of the handle within the encoder step, from -1/2 to 1/2 of the step.
    std::vector<double> within;

    [[nodiscard]] double wave(std::size_t k) const noexcept {
        if (!sines) {
            return centre + size * shape[k % shape.size()];
        }
        double sum = centre;
        for (std::size_t h = 0; 2 * h < shape.size(); ++h) {
            const double angle = 2.0 * std::numbers::pi * static_cast<double>((h + 1) * k) / period;
            sum += size * (shape[2 * h] * std::cos(angle) + shape[2 * h + 1] * std::sin(angle));
        }
        return sum;
    }
};

/// Sums over the samples of a motion, from which follows the energy that the hand pays at any damping and friction of
/// the device.
struct Account {
    double work = 0.0;    ///< sum over the samples of the mean force times the displacement d [J]
    double square = 0.0;  ///< sum d^2
    double length = 0.0;  ///< sum |d|
    /// Sum over the samples of tau (1 - tau) (change of the force within a sample)^2, with the delay fraction tau. If
    /// the speed changes within the samples, the hand gains `spread` divided by (4 b / T).
    double spread = 0.0;

    /// Returns the value of damping over period, b / T, below which the motion takes energy out of an object that
    /// stored `held`.
    [[nodiscard]] double damping(double held, double friction) const noexcept {
        if (!(square > 0.0)) {
            return 0.0;
        }
        const double paid = work + held + friction * length;
        return 0.5 * (-paid + std::sqrt(paid * paid + square * spread)) / square;
    }

    /// Returns the energy that the hand takes out by the motion at a device damping, divided by the total length of the
    /// motion.
    [[nodiscard]] double gain(double damping, double held, double friction) const noexcept {
        const double uneven = damping > 0.0 ? 0.25 * spread / damping : 0.0;
        return length > 0.0 ? (uneven - work - held - damping * square) / length - friction : 0.0;
    }
};

/// Start position, centres and sizes of the motions that a search tries.
struct Places {
    /// Position at which the handle rests before the motion; the stored energy of the object is least here.
    double start = 0.0;
    double held = 0.0;  ///< stored energy at the start minus the least stored energy, S_0 - S_min [J]
    double low = 0.0;   ///< smallest centre position of a motion
    double high = 0.0;
    double finest = 0.0;  ///< smallest size (amplitude) of a motion
    double widest = 0.0;
    double encoder_step = 0.0;
    int delay = 0;      ///< whole samples of the device's delay
    double late = 0.0;  ///< fraction of a sample by which the device's delay exceeds its whole samples
};

/// Optimises motions of a structure so that they take out energy. `limit` is the force limit of the device.
class MotionSearch {
  public:
    MotionSearch(AnyStructure& structure, const Places& places, double limit)
        : structure_{structure}, places_{places}, limit_{limit} {}

    /// Returns the largest `rate(account)` over motions and their lengths, for example the damping below which a
    /// motion takes energy out. Half of the motions are optimised for `rate`, which favours fast motions; the others
    /// are optimised for `gain`.
    template <class Rate, class Gain>
    [[nodiscard]] double most(test::Random& random, int starts, int steps, const Rate& rate,
                              const Gain& gain) {
        double best = 0.0;
        for (int k = 0; k < starts; ++k) {
            const bool slow = k % 2 == 1;
            const auto tried = [&](const Motion& motion) {
                const Found found = evaluate(motion, rate, gain);
                best = std::max(best, found.rate);
                return slow ? found.gain : found.rate;
            };
            Motion motion = random_motion(random, slow);
            double found = tried(motion);
            double stride = 0.5;
            for (int step = 0; step < steps; ++step) {
                const Motion trial = changed(random, motion, stride);
                const double here = tried(trial);
                const bool better = here > found;
                stride = std::clamp(stride * (better ? 1.6 : 0.93), 1e-3, 2.0);
                if (better) {
                    motion = trial;
                    found = here;
                }
            }
        }
        return best;
    }

    /// Largest values of rate and gain over all lengths of one motion.
    struct Found {
        double rate = 0.0;
        double gain = -std::numeric_limits<double>::infinity();
    };

    template <class Rate, class Gain>
    [[nodiscard]] Found evaluate(const Motion& motion, const Rate& rate, const Gain& gain) {
        double at = places_.start;
        if (places_.encoder_step > 0.0) {
            at = places_.encoder_step * std::round(at / places_.encoder_step);
        }
        structure_.reset(at);
        const auto late = static_cast<std::size_t>(places_.delay + (places_.late > 0.0 ? 1 : 0));
        sent_.clear();
        Account account;
        Found most;
        double read = at;
        for (std::size_t k = 0; k < ticks + late; ++k) {
            sent_.push_back(std::clamp(structure_.step(read).force, -limit_, limit_));
            if (k < late) {
                continue;  // the handle stays at the start position until the first force acts
            }
            const std::size_t now = k - late;
            read = now < approach ? places_.start + (motion.wave(0) - places_.start) *
                                                        static_cast<double>(now + 1) / approach
                                  : motion.wave(now - approach);
            double next = read;
            if (places_.encoder_step > 0.0) {
                read = places_.encoder_step * std::round(read / places_.encoder_step);
                next = read + places_.encoder_step * motion.within[now % motion.within.size()];
            }
            const double d = next - at;
            const double old = sent_[now];
            const double fresh = sent_[places_.late > 0.0 ? now + 1 : now];
            account.work += (places_.late * old + (1.0 - places_.late) * fresh) * d;
            account.spread += places_.late * (1.0 - places_.late) * (fresh - old) * (fresh - old);
            account.square += d * d;
            account.length += std::abs(d);
            at = next;
            if (now > approach) {
                most.rate = std::max(most.rate, rate(account));
                most.gain = std::max(most.gain, gain(account));
            }
        }
        return most;
    }

    static constexpr std::size_t approach = 16;
    static constexpr std::size_t ticks = 500;

  private:
    [[nodiscard]] Motion random_motion(test::Random& random, bool slow) const {
        Motion motion;
        motion.centre = random() % 3 == 0 ? places_.start : test::uniform(random, places_.low, places_.high);
        motion.size =
            places_.finest * std::exp(test::uniform(random, 0.0, std::log(places_.widest / places_.finest)));
        motion.sines = slow || random() % 3 == 0;
        if (motion.sines) {
            motion.period = std::exp(test::uniform(random, std::log(slow ? 10.0 : 2.0), std::log(100.0)));
            motion.shape.resize(2 * (1 + random() % 3));
        } else {
            constexpr int longest = 10;
            motion.shape.resize(2 + random() % (random() % 2 == 0
                                                    ? 2 * static_cast<std::size_t>(places_.delay) + 3
                                                    : longest));
        }
        const bool alternates = !motion.sines && random() % 2 == 0;
        for (std::size_t i = 0; i < motion.shape.size(); ++i) {
            motion.shape[i] =
                alternates ? (2 * i < motion.shape.size() ? 1.0 : -1.0) : test::uniform(random, -1.0, 1.0);
        }
        motion.within.resize(motion.sines ? 1 : motion.shape.size());
        for (double& part : motion.within) {
            part = random() % 2 == 0 ? 0.5 : -0.5;
        }
        return motion;
    }

    [[nodiscard]] Motion changed(test::Random& random, Motion motion, double stride) const {
        std::normal_distribution<double> normal;
        const std::size_t one = random() % (motion.shape.size() + 3);
        const bool all = random() % 2 == 0;
        for (std::size_t i = 0; i < motion.shape.size(); ++i) {
            if (all || one == i) {
                motion.shape[i] += stride * normal(random);
            }
        }
        if (all || one == motion.shape.size()) {
            motion.centre += motion.size * stride * normal(random);
        }
        if (all || one == motion.shape.size() + 1) {
            motion.size = std::max(places_.finest, motion.size * std::exp(stride * normal(random)));
        }
        if (all || one == motion.shape.size() + 2) {
            motion.period = std::max(2.0, motion.period * std::exp(0.3 * stride * normal(random)));
        }
        for (double& part : motion.within) {
            if (random() % 4 == 0) {
                part = std::clamp(part + stride * normal(random), -0.5, 0.5);
            }
        }
        return motion;
    }

    AnyStructure& structure_;
    Places places_;
    double limit_;
    std::vector<double> sent_;
};

}  // namespace palpate::energy_search
