// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "palpate/device/device.hpp"

namespace palpate {

/// Kinds of simulated faults in the exchange between the host and a device.
enum class FaultKind : std::uint8_t {
    Late,        ///< no sample arrives before the deadline of the tick
    Lost,        ///< one sample of the device is missing
    Repeated,    ///< the device sends the last sample again
    NotANumber,  ///< the reported position is NaN
    Frozen,      ///< the reported position stays constant although the handle moves
    Jump,        ///< an error (`jump`) is added to the reported position
    Saturated,   ///< the device applies half of the force and reports Limited
    Gone,        ///< the device reports Fault and makes no force for the rest of the run
};

/// Names of the faults in a text, in the order of `FaultKind`.
inline constexpr std::array<std::string_view, 8> fault_names{"late",   "lost", "repeated",  "nan",
                                                             "frozen", "jump", "saturated", "gone"};

/// One simulated fault: its kind, the number of the exchange in which it starts, and its duration [samples].
struct Fault {
    FaultKind kind = FaultKind::Late;
    std::uint64_t exchange = 0;
    std::uint64_t samples = 1;
};

/// A device that simulates faults at chosen times, for tests of programs. The readings show a fault as those of a real
/// device do: in the status, in the number of the sample, or only in wrong values. A late sample does not take longer.
template <Device D>
class Faulty {
  public:
    static constexpr bool paces_host = palpate::paces_host<D>;

    /// Makes the device from a device and a list of faults; `jump` is the position error of the fault Jump [m or rad].
    Faulty(D device, std::vector<Fault> script, double jump)
        : device_{std::move(device)}, script_{std::move(script)}, jump_{jump} {
        std::stable_sort(script_.begin(), script_.end(),
                         [](const Fault& a, const Fault& b) { return a.exchange < b.exchange; });
    }

    Opened open() {
        exchanges_ = 0;
        next_ = 0;
        disconnected_ = false;
        return device_.open();
    }

    /// Sends a command and returns a reading, both changed by the fault of this exchange, if there is one.
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        const Fault* fault = fault_of(exchanges_++);
        disconnected_ = disconnected_ || (fault != nullptr && fault->kind == FaultKind::Gone);
        if (disconnected_) {
            last_ = device_.exchange({});
            last_.status = Status::Fault;
            return last_;
        }
        if (fault == nullptr) {
            last_ = device_.exchange(command);
            return last_;
        }
        return faulty(*fault, command);
    }

    ZeroForce close() noexcept {
        const ZeroForce zero_force = closed(device_);
        return disconnected_ ? ZeroForce::NotSent : zero_force;
    }
    [[nodiscard]] const D& device() const noexcept { return device_; }

  private:
    [[nodiscard]] const Fault* fault_of(std::uint64_t exchange) noexcept {
        while (next_ < script_.size() && exchange >= script_[next_].exchange + script_[next_].samples) {
            ++next_;
        }
        return next_ < script_.size() && exchange >= script_[next_].exchange ? &script_[next_] : nullptr;
    }

    [[nodiscard]] Reading faulty(const Fault& fault, const Command& command) noexcept {
        const bool half = fault.kind == FaultKind::Saturated;
        Command sent = command;
        sent.force *= half ? 0.5 : 1.0;
        Reading now = device_.exchange(sent);
        Reading reported = now;
        switch (fault.kind) {
            case FaultKind::Late:
                reported = now = last_;
                reported.status = Status::Timeout;
                break;
            case FaultKind::Lost:
                reported = now = device_.exchange(command);
                break;
            case FaultKind::Repeated:
                reported = now = last_;
                break;
            case FaultKind::NotANumber:
                reported.position = std::numeric_limits<double>::quiet_NaN();
                break;
            case FaultKind::Frozen:
                reported.position = last_.position;
                reported.velocity = 0.0;
                now.position = last_.position;
                break;
            case FaultKind::Jump:
                reported.position += jump_;
                break;
            case FaultKind::Saturated:
                reported.status = command.force == 0.0 ? reported.status : Status::Limited;
                break;
            case FaultKind::Gone:
                break;
        }
        last_ = now;
        return reported;
    }

    D device_;
    std::vector<Fault> script_;
    double jump_;
    std::uint64_t exchanges_ = 0;
    std::size_t next_ = 0;
    bool disconnected_ = false;
    Reading last_;
};

/// Reads a simulated fault from a text `KIND@SECONDS` or `KIND@SECONDSxSAMPLES`: kind, start time and number of
/// samples, such as `late@1.5` or `frozen@2x200`. Throws std::invalid_argument with the valid form.
[[nodiscard]] inline Fault parse_fault(const std::string& text, double period_s) {
    const auto refuse = [&] {
        std::string names;
        for (const std::string_view name : fault_names) {
            names += (names.empty() ? "" : ", ") + std::string(name);
        }
        throw std::invalid_argument("fault is '" + text +
                                    "', must be KIND@SECONDS or KIND@SECONDSxSAMPLES with one of " + names);
    };
    const std::size_t at = text.find('@');
    const auto kind = std::find(fault_names.begin(), fault_names.end(), text.substr(0, at));
    if (at == std::string::npos || kind == fault_names.end()) {
        refuse();
    }
    const auto number = [&](const std::string& word) {
        std::size_t used = 0;
        double value = -1.0;
        try {
            value = std::stod(word, &used);
        } catch (const std::logic_error&) {
            refuse();
        }
        if (used != word.size() || !std::isfinite(value) || value < 0.0 || value > 1e6) {
            refuse();
        }
        return value;
    };
    const std::size_t times = text.find('x', at);
    const double seconds = number(text.substr(at + 1, times == std::string::npos ? times : times - at - 1));
    const double samples = times == std::string::npos ? 1.0 : number(text.substr(times + 1));
    return {static_cast<FaultKind>(kind - fault_names.begin()),
            static_cast<std::uint64_t>(std::llround(seconds / period_s)),
            static_cast<std::uint64_t>(std::max(1LL, std::llround(samples)))};
}

}  // namespace palpate
