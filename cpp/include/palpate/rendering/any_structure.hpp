// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "palpate/rendering/structure.hpp"

namespace palpate {

/// Holds a structure of any type. Control loop, simulation and measurement use this class, so that a program compiles
/// them once and not for each type of structure. A virtual call takes about a nanosecond of a tick. Construction and
/// copy allocate memory; the other functions do not.
class AnyStructure {
  public:
    template <class S>
        requires(!std::same_as<S, AnyStructure> && Structure<S>)
    // NOLINTNEXTLINE(google-explicit-constructor): a structure of any type is used as this class
    AnyStructure(S structure) : held_{std::make_unique<Holder<S>>(std::move(structure))} {}
    AnyStructure(const AnyStructure& other) : held_{other.held_->copy()} {}
    AnyStructure(AnyStructure&&) noexcept = default;
    AnyStructure& operator=(AnyStructure other) noexcept {
        held_ = std::move(other.held_);
        return *this;
    }
    ~AnyStructure() = default;

    /// Sets the virtual object at rest at a position.
    void reset(double position) noexcept { held_->reset(position); }
    /// Returns the force for the measured position of the device.
    [[nodiscard]] Rendered step(double position) noexcept { return held_->step(position); }
    /// Moves the virtual object by one step; `force` acts on it in place of the coupling's force. Returns zero force and
    /// the status NonFinite if the object has no mass.
    [[nodiscard]] Rendered drive(double force, const DriveLimits& limits = {}) noexcept {
        return held_->drive(force, limits);
    }
    /// Returns true if a table of solutions is used for at least a part of the positions; nothing if the structure
    /// solves no load line.
    [[nodiscard]] std::optional<bool> tabulated() const noexcept { return held_->tabulated(); }

  private:
    /// The functions of a structure, for each type.
    class Held {
      public:
        Held() = default;
        Held(const Held&) = default;
        Held& operator=(const Held&) = delete;
        virtual ~Held() = default;
        [[nodiscard]] virtual std::unique_ptr<Held> copy() const = 0;
        virtual void reset(double position) noexcept = 0;
        [[nodiscard]] virtual Rendered step(double position) noexcept = 0;
        [[nodiscard]] virtual Rendered drive(double force, const DriveLimits& limits) noexcept = 0;
        [[nodiscard]] virtual std::optional<bool> tabulated() const noexcept = 0;
    };

    template <Structure S>
    class Holder final : public Held {
      public:
        explicit Holder(S structure) : structure_{std::move(structure)} {}
        [[nodiscard]] std::unique_ptr<Held> copy() const override { return std::make_unique<Holder>(*this); }
        void reset(double position) noexcept override { structure_.reset(position); }
        [[nodiscard]] Rendered step(double position) noexcept override { return structure_.step(position); }
        [[nodiscard]] Rendered drive(double force, const DriveLimits& limits) noexcept override {
            if constexpr (requires { structure_.drive(force, limits); }) {
                return structure_.drive(force, limits);
            } else {
                return detail::refused(std::numeric_limits<double>::quiet_NaN());
            }
        }
        [[nodiscard]] std::optional<bool> tabulated() const noexcept override {
            if constexpr (requires { structure_.solver(); }) {
                return structure_.solver().tabulated();
            } else {
                return std::nullopt;
            }
        }

      private:
        S structure_;
    };

    std::unique_ptr<Held> held_;
};

static_assert(Structure<AnyStructure>);

}  // namespace palpate
