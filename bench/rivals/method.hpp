// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <string_view>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/dynamics/coupling.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/stability/coupled_inequalities.hpp"
#include "palpate/stability/direct_inequalities.hpp"
#include "palpate/stability/inequality.hpp"
#include "scene.hpp"

namespace palpate::rivals {

/// A rendering.
struct Rendering {
    AnyStructure structure;
    DeviceProfile device;  ///< its period is that of one call of `structure`
    Object object;         ///< the rendered object, which stores energy; a method may have changed it
};

/// What the motor controller received in the last ticks, the newest first.
template <class Packet>
class Sent {
  public:
    void reset() noexcept { packets_.fill({}); }
    void add(const Packet& packet) noexcept {
        std::shift_right(packets_.begin(), packets_.end(), 1);
        packets_[0] = packet;
    }
    [[nodiscard]] const Packet& operator[](int age) const noexcept {
        return packets_[static_cast<std::size_t>(age)];
    }

  private:
    std::array<Packet, 4> packets_{};  // for two samples of delay
};

/// Motor controller that receives packets of force, slope and position, and applies F_k + kappa_k (x - x_k) in each of
/// its own steps.
struct LineController {
    struct Packet {
        double force = 0.0;
        double slope = 0.0;
        double position = 0.0;
    };
    AnyStructure object;  ///< gives F_k once in each period of the host
    TableCurve slopes;    ///< kappa over the position
    int steps = 1;        ///< steps of the controller in a period of the host
    int delay = 0;        ///< samples of delay of the packets
    int number = 0;       ///< step within the period of the host
    Sent<Packet> sent{};

    void reset(double position) noexcept {
        object.reset(position);
        sent.reset();
        number = 0;
    }
    [[nodiscard]] Rendered step(double position) noexcept {
        if (number == 0) {
            sent.add({object.step(position).force, slopes.at(position).value, position});
        }
        number = (number + 1) % steps;
        const Packet& now = sent[delay];
        return {now.force + now.slope * (position - now.position), position, 1, Status::Ok, false};
    }
};

/// A way to keep a rendering stable.
struct Method {
    std::string_view name;
    std::string_view source;
    std::string_view proved;  ///< motions, hands or devices for which the source proves stability
    std::string_view knows;   ///< what the method must know, apart from the object
    bool in_package = false;  ///< true if the package renders with this method
    bool ours = false;        ///< true if this project developed the method
    /// Returns the largest factor of the object's force that the source allows; infinity: every object; NaN: the source
    /// gives no bound.
    double (*bound)(const Scene&) = nullptr;
    Rendering (*make)(const Scene&) = nullptr;
};

/// Returns all methods of the bench, in the order of their names.
[[nodiscard]] inline std::vector<Method>& methods() {
    static std::vector<Method> all;
    return all;
}

/// Adds a method to the bench. `M` has the constant `about` and the functions `bound` and `make`.
template <class M>
struct Registered {
    Registered() {
        Method method = M::about;
        method.bound = M::bound;
        method.make = M::make;
        const auto place = std::upper_bound(methods().begin(), methods().end(), method,
                                            [](const Method& a, const Method& b) { return a.name < b.name; });
        methods().insert(place, method);
    }
};

/// Bounds of a method that allows every object, and of one that states no bound.
inline constexpr double every_object = std::numeric_limits<double>::infinity();
inline constexpr double no_bound = std::numeric_limits<double>::quiet_NaN();

/// Returns the rendering by a structure that is called once in each period of the device.
template <class Use>
[[nodiscard]] Rendering rendered_by(const Scene& scene, Use use) {
    return {scene.object.with_environment(scene.period(), use), scene.profile(), scene.object};
}
[[nodiscard]] inline Rendering held(const Scene& scene) {
    return {scene.object.held(scene.period()), scene.profile(), scene.object};
}

/// Returns the stiffest coupling that is certified for the device, with a tenth of its damping.
[[nodiscard]] inline VirtualCoupling stiffest_coupling_of(const Scene& scene) {
    // The search takes milliseconds, and a scene is rendered with many factors of its object.
    thread_local DeviceProfile last;
    thread_local VirtualCoupling found;
    if (!(last == scene.profile())) {
        last = scene.profile();
        const double damping = 0.1 * last.viscous_damping;
        found = {stiffest_coupling(damping, 0.0, last), damping};
    }
    return found;
}

/// Returns the largest factor of the object's force for which direct rendering is certified. Every right side is
/// proportional to the force.
[[nodiscard]] inline double certified_scale(const Object& object, const DeviceProfile& device,
                                            int predict = 0) {
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    scheme.predict = predict;
    double scale = every_object;
    for (const Inequality& line : inequalities(DirectStructure{}, object.bounds(), scheme, device)) {
        if (line.right > 0.0) {
            scale = std::min(scale, line.left / line.right);
        }
    }
    return scale;
}

}  // namespace palpate::rivals
