// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "palpate/rendering/explicit.hpp"
#include "palpate/rendering/structure.hpp"

namespace palpate {

/// The explicit structure with n steps of T/n in every tick, the device moving evenly in between: stable for
/// slopes n^2 times as steep, at n times the cost.
template <Environment E>
class Substepped {
  public:
    Substepped(E environment, Inertia inertia, VirtualCoupling coupling, double period, int substeps)
        : inner_{std::move(environment), inertia, coupling, period / substeps}, substeps_{substeps} {}

    void reset(double position) noexcept {
        inner_.reset(position);
        device_ = position;
    }

    [[nodiscard]] Rendered step(double device) noexcept {
        const double from = device_;
        const Rendered rendered = repeat([&](int k) noexcept {
            return inner_.step(k == substeps_ ? device : from + (device - from) * k / substeps_);
        });
        if (rendered.status == Status::Ok) {
            device_ = device;
        }
        return rendered;
    }

    [[nodiscard]] Rendered drive(double force) noexcept {
        return repeat([&](int /*k*/) noexcept { return inner_.drive(force); });
    }

  private:
    template <class Step>
    [[nodiscard]] Rendered repeat(Step step) noexcept {
        Rendered rendered;
        for (int k = 1; k <= substeps_; ++k) {
            rendered = step(k);
            if (rendered.status != Status::Ok) {
                return rendered;
            }
            rendered.evaluations = k;
        }
        return rendered;
    }

    Explicit<E> inner_;
    int substeps_;
    double device_ = 0.0;  ///< x_{k-1}
};

}  // namespace palpate
