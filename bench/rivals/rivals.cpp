// SPDX-License-Identifier: Apache-2.0
// Prints every method on every object, device and delay as one JSON object.
//
//   rivals DRAWS EVERY [METHOD ...]      random scenes of each case; 1: all cases, n: each n-th case; only these methods

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "published.hpp"
#include "trial.hpp"

namespace {

using namespace palpate::rivals;

constexpr int delays = 3;
/// Range of the stiffness search, as the steepest slope of the object over 2 b / T.
constexpr double softest = 1.0 / 64.0;
constexpr double stiffest = 4096.0;

/// One measurement of one method in one scene.
struct Measured {
    double stiffness = 0.0;    ///< rendered stiffness at the largest stable factor, over 2 b / T [-]
    bool unlimited = false;    ///< true if no hand obtained energy at the stiffest object of the search
    double over_bound = 0.0;   ///< largest stable factor over the bound [-]; NaN without a finite bound
    double scale = 1.0;        ///< factor of the object at which the method is used [-]
    double energy = 0.0;       ///< energy given in use over the budget [-]
    double force_error = 0.0;  ///< force error in use over the object's force range [-]
    double acts = 0.0;
    double nanoseconds = 0.0;
};

/// One method, object, device and delay, with one measurement for each draw.
struct Case {
    const Method* method;
    std::size_t device;
    std::size_t shape;
    int delay;
    std::vector<Measured> draws;
};

/// Returns the scene of a case in a draw. It does not depend on the method.
struct Drawn {
    Scene scene;
    std::vector<Trial> trials;
};
Drawn drawn(const Case& each, std::size_t number) {
    Draw draw{1000 * number + 100 * each.device + 10 * each.shape};
    const Scene scene = scene_of(devices()[each.device], shapes.at(each.shape), each.delay, draw);
    return {scene, trials_of(scene, draw)};
}

/// Returns the scene as the method is used: the object scaled down to the bound, if the object exceeds it.
double scale_in_use(double bound) {
    return std::isnan(bound) ? 1.0 : std::min(1.0, bound);
}

Measured measure(const Case& each, std::size_t number) {
    const auto [scene, trials] = drawn(each, number);
    const Method& method = *each.method;
    const double unit = scene.device.held_stiffness();
    const double steepest = scene.object.bounds().slope.upper / unit;
    const double bound = method.bound(scene);
    Measured result;
    result.scale = scale_in_use(bound);
    const Scene used = scene.scaled(result.scale);
    const Rendering rendering = method.make(used);
    result.energy = worst_energy(rendering, trials, scene.period()) / used.budget;
    const Press press = pressed(rendering, scene);
    result.force_error = force_error_of(press, scene, rendering.device.period_s);
    result.acts = press.acts;
    // A method that gives energy in use may be stable again with a stiffer object, which does not help.
    const double highest = result.energy <= 1.0 ? stiffest / steepest : result.scale;
    const double found = largest_stable_factor(method, scene, trials, softest / steepest, highest);
    const Scene stable = scene.scaled(found);
    result.stiffness = found > 0.0 ? rendered_stiffness(method.make(stable), stable) / unit : 0.0;
    result.unlimited = found == stiffest / steepest;
    result.over_bound = std::isfinite(bound) ? found / bound : no_bound;
    return result;
}

/// Returns the values of one quantity in all draws, sorted; NaN is left out.
template <class Quantity>
std::vector<double> sorted(const Case& each, Quantity quantity) {
    std::vector<double> values;
    for (const Measured& draw : each.draws) {
        if (const double value = quantity(draw); !std::isnan(value)) {
            values.push_back(value);
        }
    }
    std::sort(values.begin(), values.end());
    return values;
}

/// Returns the 10 %, 50 % and 90 % quantiles of sorted values with four digits; null without values.
nlohmann::ordered_json quantiles(const std::vector<double>& values) {
    nlohmann::ordered_json result = nlohmann::ordered_json::array();
    for (const double share : {0.1, 0.5, 0.9}) {
        if (values.empty()) {
            return nullptr;
        }
        const double at = share * static_cast<double>(values.size() - 1);
        const double value = values[static_cast<std::size_t>(std::lround(at))];
        const double digit =
            value != 0.0 ? std::pow(10.0, std::floor(std::log10(std::abs(value))) - 3.0) : 1.0;
        result.push_back(std::isfinite(value) ? digit * std::round(value / digit) : 1e300);
    }
    return result;
}

nlohmann::ordered_json as_json(const Case& each) {
    const auto of = [&](auto quantity) { return quantiles(sorted(each, quantity)); };
    std::size_t unlimited = 0;
    for (const Measured& draw : each.draws) {
        unlimited += draw.unlimited ? 1 : 0;
    }
    return {{"method", each.method->name},
            {"device", devices()[each.device].name},
            {"object", shapes.at(each.shape).name},
            {"delay", each.delay},
            {"stiffness", of([](const Measured& m) { return m.stiffness; })},
            {"unlimited", static_cast<double>(unlimited) / static_cast<double>(each.draws.size())},
            {"over_bound", of([](const Measured& m) { return m.over_bound; })},
            {"scale", of([](const Measured& m) { return m.scale; })},
            {"energy", of([](const Measured& m) { return m.energy; })},
            {"force_error", of([](const Measured& m) { return m.force_error; })},
            {"acts", of([](const Measured& m) { return m.acts; })},
            {"nanoseconds", each.draws.front().nanoseconds}};
}

/// Runs `work(k)` for all k below `count`, on all cores.
template <class Work>
void on_all_cores(std::size_t count, Work work) {
    std::atomic<std::size_t> next = 0;
    std::vector<std::jthread> threads;
    for (unsigned core = 0; core < std::max(1U, std::thread::hardware_concurrency()); ++core) {
        threads.emplace_back([&] {
            for (std::size_t k = next++; k < count; k = next++) {
                work(k);
            }
        });
    }
}

}  // namespace

int main(int count, char** words) {
    const int draws = count > 1 ? std::atoi(words[1]) : 0;
    const int every = count > 2 ? std::atoi(words[2]) : 0;
    const std::vector<std::string_view> only(words + std::min(count, 3), words + count);
    if (draws < 1 || every < 1) {
        std::fputs("usage: rivals DRAWS EVERY [METHOD ...], DRAWS and EVERY at least 1\n", stderr);
        return 2;
    }
    std::vector<Case> cases;
    int number = 0;
    nlohmann::ordered_json described = nlohmann::ordered_json::array();
    for (const Method& method : methods()) {
        if (!only.empty() && std::find(only.begin(), only.end(), method.name) == only.end()) {
            continue;
        }
        described.push_back({{"name", method.name},
                             {"source", method.source},
                             {"proved", method.proved},
                             {"knows", method.knows},
                             {"in_package", method.in_package},
                             {"ours", method.ours}});
        for (std::size_t device = 0; device < devices().size(); ++device) {
            for (std::size_t shape = 0; shape < shapes.size(); ++shape) {
                for (int delay = 0; delay < delays; ++delay) {
                    if (number++ % every == 0) {
                        cases.push_back({&method, device, shape, delay,
                                         std::vector<Measured>(static_cast<std::size_t>(draws))});
                    }
                }
            }
        }
    }
    if (cases.empty()) {
        std::fputs("rivals: no method has one of these names\n", stderr);
        return 2;
    }
    const auto total = static_cast<std::size_t>(draws);
    on_all_cores(cases.size() * total, [&](std::size_t k) {
        cases[k / total].draws[k % total] = measure(cases[k / total], k % total);
    });
    for (Case& each : cases) {  // times are measured alone
        const Scene scene = drawn(each, 0).scene;
        const Scene used = scene.scaled(each.draws[0].scale);
        const Rendering rendering = each.method->make(used);
        each.draws[0].nanoseconds =
            1e9 * seconds_per_tick(rendering, used, pressed(rendering, scene).readings);
    }
    nlohmann::ordered_json simulated = nlohmann::ordered_json::array();
    for (const Device& device : devices()) {
        simulated.push_back({{"name", device.name},
                             {"unit", device.unit},
                             {"damping", device.profile.viscous_damping},
                             {"friction", device.profile.coulomb_friction},
                             {"encoder_step", device.profile.encoder_step},
                             {"period_s", device.profile.period_s},
                             {"controller_steps", device.controller_steps},
                             {"speed", device.speed}});
    }
    nlohmann::ordered_json printed{{"draws", draws},
                                   {"devices", simulated},
                                   {"methods", described},
                                   {"published", published_as_json()},
                                   {"cases", {}}};
    for (const Case& each : cases) {
        printed["cases"].push_back(as_json(each));
    }
    std::puts(printed.dump(1).c_str());
    return 0;
}
