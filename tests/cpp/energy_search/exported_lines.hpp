// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>

#include "../support.hpp"
#include "held_lines.hpp"
#include "held_scenes.hpp"
#include "line.hpp"
#include "palpate/portable/exported_force.hpp"
#include "palpate/portable/exported_model.hpp"
#include "palpate/rendering/structure.hpp"
#include "palpate/stability/certificate.hpp"

namespace palpate::energy_search {

/// A structure that computes its force with the arithmetic of an exported program in single precision.
class ExportedStructure {
  public:
    explicit ExportedStructure(std::shared_ptr<const ExportedModel> model)
        : model_{std::move(model)}, force_{*model_} {}

    void reset(double position) noexcept { state_ = force_.start(count(position)); }
    [[nodiscard]] Rendered step(double position) noexcept {
        return {force_.step(state_, count(position)), position, 0, Status::Ok, false};
    }

  private:
    [[nodiscard]] std::int32_t count(double position) const noexcept {
        return static_cast<std::int32_t>(std::lround(position / model_->target().encoder_step));
    }

    std::shared_ptr<const ExportedModel> model_;
    ExportedForce<float> force_;
    ExportedState<float> state_;
};

/// Returns a random model, or a straight line, whose steepest slope rises. The hysteresis adds a slope of about this
/// size. Some models without hysteresis are periodic.
[[nodiscard]] inline ForceModel exportable_model(test::Random& random, double play_radius) {
    NetworkParameters network = test::random_network(random, random() % 4);
    Domain domain = test::unit_domain();
    const Interval slopes = slope_bounds(network, 0.0, 1.0);
    const double slope = slopes.largest();
    if (slope > slopes.upper) {  // a falling force needs less friction
        for (double* number : {&network.linear[0], &network.bias}) {
            *number = -*number;
        }
        for (double& weight : network.weight) {
            weight = -weight;
        }
    }
    if (play_radius > 0.0) {
        HysteresisParameters hysteresis{std::vector<double>(network.weight.size()), 0.0,
                                        slope * play_radius * test::uniform(random, 0.1, 1.0)};
        return {network, hysteresis, domain, play_radius};
    }
    if (random() % 4 == 0) {
        network.linear = {0.0};
        domain.period = 1.0;
    }
    return {network, domain};
}

/// Makes a scene of an exported model in single precision on an encoder with 20 to 26 bits for each turn, where the
/// rounding of the force from count to count is largest compared with the friction that the encoder requires. The
/// structure is direct, with or without a prediction, or massless without damper. `with_rounding` is true if the
/// certificate includes the rounding.
[[nodiscard]] inline std::optional<Trial> draw_exported(test::Random& random, double delay, bool hysteresis,
                                                        bool with_rounding = true) {
    const double step = std::ldexp(2.0 * std::numbers::pi, -20 - static_cast<int>(random() % 7));
    const int radius = hysteresis ? 1 + static_cast<int>(random() % 3) : 0;
    const ForceModel model = exportable_model(random, radius * step);
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    if (!hysteresis && random() % 3 == 0) {
        const double steepest = std::max(0.1, force_bounds(model).slope.largest());
        scheme.structure = StructureKind::Massless;
        scheme.coupling = {steepest * std::exp(test::uniform(random, 0.5, 2.0)), 0.0};
        scheme.compensated = random() % 2 == 0;
    } else if (!hysteresis && random() % 3 == 0) {
        scheme.predict = 1 + static_cast<int>(random() % (delay > 1.0 ? 1 : 2));
    }
    const NetworkCurve& curve = hysteresis ? model.hysteresis()->force() : model.network()->curve();
    const auto force = [&](double x) { return curve.at(x).value; };
    DeviceProfile device = random_device(random, delay);
    device.encoder_step = step;
    device.force_limit = curve.value_bounds().largest() * test::uniform(random, 0.3, 3.0) + 1e-3;
    if (scheme.structure == StructureKind::Massless &&
        device.force_limit > 0x1p22 * step * scheme.coupling.stiffness) {
        return std::nullopt;  // the lag of the object would have too many counts for the program
    }
    const auto exported = std::make_shared<const ExportedModel>(
        model, scheme, ExportTarget{step, device.period_s, device.force_limit});
    const auto need = certified_need(device, [&](const DeviceProfile& generous) {
        return with_force_error(certify(model, scheme, generous),
                                with_rounding ? exported->rendering_error() : 0.0);
    });
    if (!need || need->damping <= 0.0) {
        return std::nullopt;
    }
    const int window = samples_of(delay) + scheme.predict;
    const int counts = hysteresis ? (window == 0   ? 14
                                     : window == 1 ? 8
                                                   : 4)
                                  : (window == 0   ? 24
                                     : window == 1 ? 12
                                     : window == 2 ? 6
                                                   : 4);
    const double place = random() % 4 != 0 ? steepest_place(force) : test::uniform(random, 0.0, 1.0);
    HeldScene scene;
    scene.read = encoder_grid(step * std::round(place / step), step, counts, window == 0 ? 1 : 0);
    const ExportedStructure structure{exported};
    scene.table = hysteresis ? play_table_of(structure, scene.read, radius, sent_on(device))
                             : table_of(structure, scene.read, scheme.predict, sent_on(device));
    // A motion over a few counts needs no stored energy; only its repetition takes energy out
    scene.held.assign(scene.read.grid.position.size(), std::numeric_limits<double>::infinity());
    Trial trial = trial_of(std::move(scene), *need, device);
    trial.text = std::string(name_of(scheme.structure)) + ", predict " + readable(scheme.predict) +
                 ", encoder step " + readable(step) + ", force limit " + readable(device.force_limit);
    return trial;
}

}  // namespace palpate::energy_search
