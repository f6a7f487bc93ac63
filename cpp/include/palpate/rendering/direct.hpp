// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "palpate/model/environment.hpp"
#include "palpate/model/velocity_network.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/structure.hpp"

namespace palpate {

/// Direct rendering: the force is F = f(x), with the measured position x and the model's force f. The only memory is
/// that of the environment, for example the play operator of a model with hysteresis.
template <Environment E>
class Direct {
  public:
    explicit Direct(E environment) : environment_{std::move(environment)} { reset(0.0); }

    /// Resets the state of the virtual object to that of an object at rest at this position.
    void reset(double position) noexcept { state_ = environment_.start(position); }

    /// Returns the force at the measured position.
    [[nodiscard]] Rendered step(double position) noexcept {
        typename E::State state = state_;
        const EnvironmentSample sample = moved(position, state);
        if (!std::isfinite(position) || !std::isfinite(sample.force)) {
            return detail::refused(position);
        }
        state_ = state;
        return {sample.force, position, 1, Status::Ok, sample.extrapolated};
    }

  private:
    /// Moves the state to this position and returns the sample there. `move` computes both at once.
    [[nodiscard]] EnvironmentSample moved(double position, typename E::State& state) const noexcept {
        if constexpr (requires { environment_.move(position, state); }) {
            return environment_.move(position, state);
        } else {
            const EnvironmentSample sample = environment_.at(position, state);
            environment_.advance(position, state);
            return sample;
        }
    }

    E environment_;
    typename E::State state_;
};

/// Direct rendering of a model f of position x and velocity v: F = f(x, v), v = (x_k - x_{k-1}) / T. The velocity is
/// computed from the last two samples, because the proof of the certificate is valid for this velocity.
class DirectVelocity {
  public:
    DirectVelocity(VelocityNetwork force, double period_s) : force_{std::move(force)}, period_s_{period_s} {}

    /// Resets the state of the virtual object to that of an object at rest at this position.
    void reset(double position) noexcept { last_ = position; }

    /// Returns the force at the measured position and velocity.
    [[nodiscard]] Rendered step(double position) noexcept {
        const double velocity = (position - last_) / period_s_;
        const double force = force_.force(position, velocity);
        if (!std::isfinite(force)) {  // as at each position that is not finite
            return detail::refused(position);
        }
        last_ = position;
        return {force, position, 1, Status::Ok, force_.extrapolated(position, velocity)};
    }

  private:
    VelocityNetwork force_;
    double period_s_;
    double last_ = 0.0;
};

static_assert(Structure<DirectVelocity>);

/// Largest number of past samples (taps) that the prediction of the position may use.
inline constexpr int most_prediction_taps = 16;

/// Returns the weight w_j of the motion d_{k-j} = x_{k-j+1} - x_{k-j} between two samples, in the prediction with m
/// taps: w_j = (m - j + 1) / (m (m + 1)). The sum of w_1 to w_m is 1/2.
[[nodiscard]] constexpr double prediction_weight(int taps, int j) noexcept {
    return static_cast<double>(taps - j + 1) / (taps * (taps + 1.0));
}

/// Predicts the position half a period ahead, which is the mean position while the device holds a force for one period:
///
///     x_hat = x_k + (x_k - mean(x_{k-1}, ..., x_{k-m})) / (m + 1) = x_k + sum of w_j d_{k-j}.
///
/// x_k is the last sample. The prediction is exact at constant velocity for every m. With a larger m, a certificate
/// needs less device damping, but the prediction reacts later to a change of velocity (docs/certificate.md).
class HalfSamplePrediction {
  public:
    /// Makes a prediction from m = `taps` past samples, from 1 to `most_prediction_taps`.
    explicit HalfSamplePrediction(int taps) noexcept
        : taps_{static_cast<std::size_t>(taps)}, share_{1.0 / (taps * (taps + 1.0))} {}

    /// Sets all past positions to one position, as for a handle at rest.
    void reset(double position) noexcept { past_.fill(position); }

    /// Returns x_hat, the position predicted from the newest measured position and the m positions measured before it.
    [[nodiscard]] double ahead(double position) const noexcept {
        double moved = 0.0;
        for (std::size_t j = 0; j < taps_; ++j) {
            moved += position - past_[j];
        }
        return position + share_ * moved;
    }

    /// Stores a measured position in place of the oldest stored position.
    void advance(double position) noexcept {
        past_[next_] = position;
        next_ = next_ + 1 == taps_ ? 0 : next_ + 1;
    }

  private:
    std::size_t taps_;
    double share_;
    std::size_t next_ = 0;
    std::array<double, most_prediction_taps> past_{};
};

/// Direct rendering with prediction: F = f(x_hat), where x_hat is the position predicted half a period ahead. The
/// environment's memory, such as the play operator of a hysteresis, follows the measured position. The force is
/// computed for a motion from the measured position to x_hat, which does not change the memory.
template <Environment E>
class PredictedDirect {
  public:
    PredictedDirect(E environment, int taps) : environment_{std::move(environment)}, prediction_{taps} {
        reset(0.0);
    }

    /// Resets the state of the virtual object to that of an object at rest at this position.
    void reset(double position) noexcept {
        state_ = environment_.start(position);
        prediction_.reset(position);
    }

    /// Returns the force at the predicted position.
    [[nodiscard]] Rendered step(double position) noexcept {
        const double ahead = prediction_.ahead(position);
        typename E::State state = state_;
        environment_.advance(position, state);
        const EnvironmentSample sample = environment_.at(ahead, state);
        if (!std::isfinite(ahead) || !std::isfinite(sample.force)) {
            return detail::refused(position);
        }
        state_ = state;
        prediction_.advance(position);
        return {sample.force, ahead, 1, Status::Ok, sample.extrapolated};
    }

  private:
    E environment_;
    typename E::State state_;
    HalfSamplePrediction prediction_;
};

/// Builds the direct structure: `PredictedDirect` if a prediction is chosen, otherwise `Direct`.
struct DirectStructure {
    static constexpr StructureTraits traits{.name = "direct", .velocity = true, .predicts = true};

    template <Environment E, class SolverOf>
    static AnyStructure build(E environment, const StructureNumbers& numbers, const SolverOf& /*solver_of*/) {
        if (numbers.predict > 0) {
            return PredictedDirect{std::move(environment), numbers.predict};
        }
        return Direct{std::move(environment)};
    }
};

}  // namespace palpate
