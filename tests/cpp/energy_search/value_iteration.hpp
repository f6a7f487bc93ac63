// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace palpate::energy_search {

/// Grid of positions between which the handle moves. From position number i one move reaches the positions i - reach
/// to i + reach.
struct Grid {
    std::vector<double> position;  ///< positions of the handle, never decreasing [m or rad]
    int reach = 0;                 ///< largest number of grid positions that one move can pass
    /// Length of one revolution of a wheel; 0 for positions that do not repeat [m or rad].
    double turn = 0.0;

    [[nodiscard]] int nodes() const noexcept { return static_cast<int>(position.size()); }
    [[nodiscard]] bool repeats() const noexcept { return turn > 0.0; }
    /// Returns the number of values that a stored earlier position can have. It is stored as its grid index, or as its
    /// index modulo 2 reach + 1.
    [[nodiscard]] int residues() const noexcept { return std::min(nodes(), 2 * reach + 1); }
};

/// Windows: lists of `older` + 1 consecutive positions, newest first, numbered 0, 1, ... The newest position is stored
/// as its grid index, each older one as its index modulo 2 reach + 1. The next newer position makes this residue
/// unique.
class Windows {
  public:
    struct Nodes {
        int node[8];
    };

    Windows(const Grid& grid, int older)
        : nodes_{grid.nodes()},
          residues_{grid.residues()},
          reach_{grid.reach},
          older_{older},
          repeats_{grid.repeats()} {
        for (int k = 0; k < older; ++k) {
            stride_ *= static_cast<std::size_t>(residues_);
        }
    }

    [[nodiscard]] int older() const noexcept { return older_; }
    [[nodiscard]] std::size_t stride() const noexcept { return stride_; }
    [[nodiscard]] std::size_t count() const noexcept { return stride_ * static_cast<std::size_t>(nodes_); }
    [[nodiscard]] int newest(std::size_t window) const noexcept { return static_cast<int>(window / stride_); }

    [[nodiscard]] Nodes nodes_of(std::size_t window) const noexcept {
        Nodes result{};
        std::size_t below = stride_;
        std::size_t rest = window % stride_;
        result.node[0] = newest(window);
        for (int k = 1; k <= older_; ++k) {
            below /= static_cast<std::size_t>(residues_);
            const int residue = static_cast<int>(rest / below);
            rest %= below;
            result.node[k] = residues_ == nodes_ ? residue : resolved(residue, result.node[k - 1]);
        }
        return result;
    }

    /// Returns false if a window (consecutive handle positions) contains a position outside the grid.
    [[nodiscard]] bool exists(const Nodes& w) const noexcept {
        return std::all_of(w.node, w.node + older_ + 1, [&](int node) { return node >= 0 && node < nodes_; });
    }

    /// Returns the number of the window (consecutive handle positions) that begins at element `first` of `w`.
    [[nodiscard]] std::size_t number(const Nodes& w, int first) const noexcept {
        auto window = static_cast<std::size_t>(w.node[first]);
        for (int k = 1; k <= older_; ++k) {
            window = window * static_cast<std::size_t>(residues_) +
                     static_cast<std::size_t>(w.node[first + k] % residues_);
        }
        return window;
    }

    [[nodiscard]] std::size_t at_rest(int node) const noexcept {
        Nodes w{};
        std::fill(w.node, w.node + older_ + 1, node);
        return number(w, 0);
    }

    [[nodiscard]] std::size_t moved(std::size_t window, int to) const noexcept {
        if (older_ == 0) {
            return static_cast<std::size_t>(to);
        }
        const auto residues = static_cast<std::size_t>(residues_);
        const auto from = static_cast<std::size_t>(newest(window) % residues_);
        return static_cast<std::size_t>(to) * stride_ + from * (stride_ / residues) +
               window % stride_ / residues;
    }

  private:
    /// Returns the grid index that one move from `near` can reach and whose remainder after division by `residues_` is
    /// `residue`.
    [[nodiscard]] int resolved(int residue, int near) const noexcept {
        int offset = (residue - near) % residues_;
        offset = offset < 0 ? offset + residues_ : offset;
        offset = offset > reach_ ? offset - residues_ : offset;
        const int node = near + offset;
        return repeats_ ? (node + nodes_) % nodes_ : node;
    }

    int nodes_;
    int residues_;
    int reach_;
    int older_;
    bool repeats_;
    std::size_t stride_ = 1;
};

/// Force that a structure computes from the last readings, as a table over the grid positions. `of` has one value for
/// each play state and each window (i_0, r_1, ..., r_memory); i_0 is the newest position, r_j the residue of an older
/// one.
struct ForceTable {
    int memory = 0;  ///< number of older positions on which the force depends
    int plays = 1;   ///< number of states that the play operator can have
    /// Force for each state of the play operator and each window of positions [N or N*m]
    std::vector<double> of;
    /// [play * nodes + node]: state of the play operator after the state `play`, when the handle is at grid position
    /// `node`
    std::vector<int> next_play;
    /// State of the play operator after a start at rest at each grid position
    std::vector<int> rest_play;

    [[nodiscard]] int play_after(int play, int node, int nodes) const noexcept {
        return plays == 1 ? 0 : next_play[static_cast<std::size_t>(play * nodes + node)];
    }
};

/// Damping, friction and delay of the device, which increase the energy that a motion costs the hand.
struct Cost {
    double damping = 0.0;   ///< device damping divided by the period, b / T [N/m or N*m/rad]
    double friction = 0.0;  ///< Coulomb friction f_c [N or N*m]
    int delay = 0;          ///< delay n [whole samples]
    double late = 0.0;      ///< tau, fraction of a sample in which the previous command still acts

    /// Returns the least energy that the hand pays for a displacement d while the force changes from `old` to `now`
    /// after the time tau T. The handle moves uniformly in each of the two parts, because uneven motion costs more.
    /// The displacement of the first part stays within [down, up].
    [[nodiscard]] double of_move(double d, double old, double now, double down, double up) const noexcept {
        if (late == 0.0) {
            return now * d + damping * d * d + friction * std::abs(d);
        }
        const double shift = late * (1.0 - late) / (2.0 * damping);
        const double low = std::min(0.0, d);
        const double high = std::max(0.0, d);
        double part = late * d - (old - now) * shift;
        if (part > high) {
            part = std::max(high, late * d - (old - now + 2.0 * friction) * shift);
        } else if (part < low) {
            part = std::min(low, late * d - (old - now - 2.0 * friction) * shift);
        }
        part = std::clamp(part, down, up);
        const double rest = d - part;
        return old * part + now * rest + damping * (part * part / late + rest * rest / (1.0 - late)) +
               friction * (std::abs(part) + std::abs(rest));
    }
};

/// A device with sample times k period + u_k, where u_k is either 0 or the jitter, and commands that act `delay` after
/// their samples. Each position of the grid has two consecutive entries, one for each u_k.
struct Clock {
    double period = 1.0;   ///< [s]
    double jitter = 0.0;   ///< largest delay of a sample after its nominal time, less than the period [s]
    double delay = 0.0;    ///< [s]
    double damping = 0.0;  ///< device damping b [N*s/m or N*m*s/rad]

    /// Returns the number of earlier samples whose commands can still act.
    [[nodiscard]] int older() const noexcept {
        return std::max(1, static_cast<int>(std::ceil((delay + jitter) / period)));
    }
};

/// Largest energy that a hand takes out of the rendering, found by value iteration.
struct Finding {
    double taken = 0.0;  ///< largest energy taken out, -E - (S_0 - S_min), over starts at rest [J]
    bool cycle = false;  ///< in some repeated motion the hand takes energy out at each repetition
    /// The value iteration ended: no motion on the grid takes more energy out than `taken`
    bool converged = false;
    /// Largest force times the distance between the first and last grid position [J]
    double scale = 0.0;

    [[nodiscard]] bool violated() const noexcept { return cycle || taken > 1e-6 * scale; }
};

/// Finds the motion over the grid that takes the most energy out, as a shortest path. The state is the window of
/// positions on which the force still depends. J(state) is the least energy that the hand pays from this state on, for
/// any number of samples. J decreases without limit if a motion can be repeated and takes energy out at each
/// repetition.
class ValueIteration {
  public:
    ValueIteration(const Grid& grid, const ForceTable& table, const Cost& cost)
        : grid_{grid},
          table_{&table},
          before_{&table},
          cost_{cost},
          windows_{grid, cost.delay + table.memory + (cost.late > 0.0 ? 1 : 0)},
          nodes_{grid.nodes()},
          plays_{static_cast<std::size_t>(table.plays)},
          value_(windows_.count() * plays_, 0.0),
          policy_(value_.size(), none) {
        fill();
    }

    /// Makes a search for sample times with jitter; `table` must hold a force that depends only on the current
    /// position.
    ValueIteration(const Grid& grid, const ForceTable& table, const Clock& clock)
        : grid_{grid},
          table_{&table},
          before_{&table},
          cost_{},
          windows_{grid, clock.older()},
          nodes_{grid.nodes()},
          plays_{1},
          value_(windows_.count(), 0.0),
          policy_(value_.size(), none) {
        fill(clock);
    }

    /// Searches until the first motion takes energy out. `held[i]` is the stored energy S_0 - S_min at grid position
    /// i, at rest.
    [[nodiscard]] Finding run(const std::vector<double>& held, int sweeps = 2000) {
        Finding finding;
        finding.scale =
            largest_force_ * std::max(longest_move_, grid_.position.back() - grid_.position.front()) + 1e-300;
        const double least_gain = 1e-11 * largest_force_ * longest_move_;
        for (int sweep = 0; sweep < sweeps && !finding.violated(); ++sweep) {
            const double gain = sweep_once(sweep % 2 == 0, least_gain);
            finding.converged = gain <= least_gain;
            if (sweep % 8 == 7 || finding.converged) {
                finding.cycle = has_gaining_cycle(10.0 * least_gain);
                finding.taken = taken_at_rest(held);
            }
            if (finding.converged) {
                break;
            }
        }
        return finding;
    }

    /// Puts a motion with another force before the motions already searched. The other force acts from the first
    /// sample until the force table of the earlier search replaces it.
    void precede(const ForceTable& table) {
        table_ = before_ = &table;
        std::fill(policy_.begin(), policy_.end(), none);
        fill();
    }

    /// Puts one sample before the motions already searched. The command of this sample is from `table`; a command of
    /// the sample before, if it still acts, is from `before`.
    void precede_once(const ForceTable& table, const ForceTable& before) {
        table_ = &table;
        before_ = &before;
        std::fill(policy_.begin(), policy_.end(), none);
        fill();
        const std::vector<double> later = value_;
        for (std::size_t state = 0; state < value_.size(); ++state) {
            value_[state] = 0.0;
            for (int jump = lowest(state); exists_[state] != 0 && jump <= highest(state); ++jump) {
                value_[state] = std::min(value_[state], cost_of(state, jump) + later[after(state, jump)]);
            }
        }
    }

    /// Returns the largest energy taken out by motions that start at rest.
    [[nodiscard]] Finding found(const std::vector<double>& held) const {
        Finding finding;
        finding.scale =
            largest_force_ * std::max(longest_move_, grid_.position.back() - grid_.position.front()) + 1e-300;
        finding.taken = taken_at_rest(held);
        finding.converged = true;
        return finding;
    }

  private:
    static constexpr std::int16_t none = INT16_MIN;

    void fill() {
        const bool late = cost_.late > 0.0;
        // Index, in the window of stored positions, of the position that the play operator has followed last.
        const int newest = cost_.delay + (late ? 1 : 0);
        const Windows read{grid_, table_->memory};
        now_.assign(value_.size(), 0.0);
        old_.assign(late ? value_.size() : 0, 0.0);
        exists_.assign(value_.size(), 0);
        next_play_.assign(value_.size(), 0);
        play_is_new_ = plays_ > 1 && newest == 0;
        for (std::size_t window = 0; window < windows_.count(); ++window) {
            const Windows::Nodes w = windows_.nodes_of(window);
            if (!windows_.exists(w)) {
                continue;
            }
            for (std::size_t play = 0; play < plays_; ++play) {
                const std::size_t state = window * plays_ + play;
                const double force = table_->of[play * read.count() + read.number(w, newest)];
                if (!std::isfinite(force)) {
                    continue;  // the play operator cannot have this state at this position
                }
                const int before = static_cast<int>(play);
                const int later =
                    newest > 0 ? table_->play_after(before, w.node[newest - 1], nodes_) : before;
                next_play_[state] = static_cast<std::size_t>(later);
                now_[state] = force;
                if (late) {
                    old_[state] = before_->of[play * read.count() + read.number(w, newest)];
                    now_[state] = table_->of[next_play_[state] * read.count() + read.number(w, newest - 1)];
                }
                exists_[state] = 1;
                largest_force_ = std::max(largest_force_, std::abs(now_[state]));
            }
        }
        measure_moves();
    }

    void measure_moves() noexcept {
        for (int i = 0; i < nodes_; ++i) {
            for (int jump = -grid_.reach; jump <= grid_.reach; ++jump) {
                longest_move_ = std::max(longest_move_, can_move(i, jump) ? std::abs(move(i, jump)) : 0.0);
            }
        }
    }

    /// Quantities that give the cost of one sample, for each state and for each of the two time shifts u_k of the next
    /// sample.
    struct Sample {
        double force = 0.0;    ///< mean force during the sample
        double damping = 0.0;  ///< device damping b divided by the duration of the sample
        /// Energy that the hand gains if its speed changes when the force changes [J]
        double uneven = 0.0;
    };

    void fill(const Clock& clock) {
        now_.assign(value_.size(), 0.0);
        exists_.assign(value_.size(), 0);
        next_play_.assign(value_.size(), 0);
        samples_.resize(2 * value_.size());
        const int older = windows_.older();
        for (std::size_t window = 0; window < windows_.count(); ++window) {
            const Windows::Nodes w = windows_.nodes_of(window);
            if (!windows_.exists(w)) {
                continue;
            }
            exists_[window] = 1;
            const auto taken = [&](int k) { return -k * clock.period + (w.node[k] % 2) * clock.jitter; };
            const auto force = [&](int k) { return table_->of[static_cast<std::size_t>(w.node[k])]; };
            largest_force_ = std::max(largest_force_, std::abs(force(0)));
            for (std::size_t u = 0; u < 2; ++u) {
                const double end = clock.period + static_cast<double>(u) * clock.jitter;
                const double length = end - taken(0);
                double work = 0.0;
                double square = 0.0;
                for (int k = older; k >= 0;
                     --k) {  // the command of sample k acts until the command of sample k + 1 acts
                    const double from = k == older ? taken(0) : std::max(taken(0), taken(k) + clock.delay);
                    const double to = k == 0 ? end : std::min(end, taken(k - 1) + clock.delay);
                    if (to > from) {
                        work += force(k) * (to - from);
                        square += force(k) * force(k) * (to - from);
                    }
                }
                const double mean = work / length;
                samples_[2 * window + u] = {mean, clock.damping / length,
                                            std::max(0.0, square - mean * work) / (4.0 * clock.damping)};
            }
        }
        measure_moves();
    }

    [[nodiscard]] bool can_move(int from, int jump) const noexcept {
        return grid_.repeats() || (from + jump >= 0 && from + jump < nodes_);
    }
    /// `down` and `up` return the displacements from one grid position to the first and to the last grid position.
    [[nodiscard]] double down(int from) const noexcept {
        return grid_.repeats() ? -HUGE_VAL
                               : grid_.position.front() - grid_.position[static_cast<std::size_t>(from)];
    }
    [[nodiscard]] double up(int from) const noexcept {
        return grid_.repeats() ? HUGE_VAL
                               : grid_.position.back() - grid_.position[static_cast<std::size_t>(from)];
    }
    [[nodiscard]] int target(int from, int jump) const noexcept {
        const int node = from + jump;
        return node < 0 ? node + nodes_ : node >= nodes_ ? node - nodes_ : node;
    }
    [[nodiscard]] double move(int from, int jump) const noexcept {
        const int node = from + jump;
        const double turned = node < 0 ? -grid_.turn : node >= nodes_ ? grid_.turn : 0.0;
        return grid_.position[static_cast<std::size_t>(target(from, jump))] + turned -
               grid_.position[static_cast<std::size_t>(from)];
    }

    [[nodiscard]] int lowest(std::size_t state) const noexcept {
        return grid_.repeats() ? -grid_.reach : std::max(-grid_.reach, -place(state));
    }
    [[nodiscard]] int highest(std::size_t state) const noexcept {
        return grid_.repeats() ? grid_.reach : std::min(grid_.reach, nodes_ - 1 - place(state));
    }

    [[nodiscard]] int place(std::size_t state) const noexcept { return windows_.newest(state / plays_); }

    [[nodiscard]] std::size_t after(std::size_t state, int jump) const noexcept {
        const std::size_t window = state / plays_;
        const int to = target(windows_.newest(window), jump);
        const std::size_t play =
            play_is_new_
                ? static_cast<std::size_t>(table_->play_after(static_cast<int>(state % plays_), to, nodes_))
                : next_play_[state];
        return windows_.moved(window, to) * plays_ + play;
    }

    [[nodiscard]] double cost_of(std::size_t state, int jump) const noexcept {
        const double d = move(place(state), jump);
        if (!samples_.empty()) {
            const Sample& sample =
                samples_[2 * state + static_cast<std::size_t>(target(place(state), jump) % 2)];
            return (sample.force + sample.damping * d) * d - sample.uneven;
        }
        return cost_.of_move(d, old_.empty() ? 0.0 : old_[state], now_[state], down(place(state)),
                             up(place(state)));
    }

    /// Improves the value of every state once; returns the largest improvement.
    [[nodiscard]] double sweep_once(bool upward, double least_gain) {
        double most = 0.0;
        const std::size_t states = value_.size();
        for (std::size_t k = 0; k < states; ++k) {
            const std::size_t state = upward ? k : states - 1 - k;
            if (exists_[state] == 0) {
                continue;
            }
            const int from = place(state);
            double best = value_[state] - least_gain;
            int chosen = none;
            const int last = highest(state);
            const double now = now_[state];
            const double old = old_.empty() ? 0.0 : old_[state];
            const std::size_t base = windows_.moved(state / plays_, 0) * plays_ + next_play_[state];
            for (int jump = lowest(state); jump <= last; ++jump) {
                const std::size_t next = play_is_new_ ? after(state, jump)
                                                      : base + static_cast<std::size_t>(target(from, jump)) *
                                                                   windows_.stride() * plays_;
                const double total =
                    (samples_.empty() ? cost_.of_move(move(from, jump), old, now, down(from), up(from))
                                      : cost_of(state, jump)) +
                    value_[next];
                if (total < best) {
                    best = total;
                    chosen = jump;
                }
            }
            if (chosen != none) {
                most = std::max(most, value_[state] - best);
                value_[state] = best;
                policy_[state] = static_cast<std::int16_t>(chosen);
            }
        }
        return most;
    }

    /// Returns true if the best moves from some state form a closed motion that takes energy out.
    [[nodiscard]] bool has_gaining_cycle(double least) const {
        std::vector<std::uint32_t> seen(value_.size(), 0);
        std::uint32_t walk = 0;
        for (std::size_t first = 0; first < value_.size(); ++first) {
            std::size_t state = first;
            ++walk;
            while (seen[state] == 0 && policy_[state] != none) {
                seen[state] = walk;
                state = after(state, policy_[state]);
            }
            if (seen[state] != walk) {
                continue;
            }
            double sum = 0.0;
            std::size_t along = state;
            do {
                sum += cost_of(along, policy_[along]);
                along = after(along, policy_[along]);
            } while (along != state);
            if (sum < -least) {
                return true;
            }
        }
        return false;
    }

    [[nodiscard]] double taken_at_rest(const std::vector<double>& held) const {
        double most = 0.0;
        for (int i = 0; i < nodes_; ++i) {
            const auto node = static_cast<std::size_t>(i);
            const std::size_t play = plays_ == 1 ? 0 : static_cast<std::size_t>(table_->rest_play[node]);
            most = std::max(most, -value_[windows_.at_rest(i) * plays_ + play] - held[node]);
        }
        return most;
    }

    const Grid& grid_;
    const ForceTable* table_;
    /// Table of the forces that the device applies until the new command acts
    const ForceTable* before_;
    Cost cost_;
    Windows windows_;
    int nodes_;
    std::size_t plays_;
    bool play_is_new_ = false;
    double largest_force_ = 0.0;
    double longest_move_ = 0.0;
    std::vector<double> value_;
    std::vector<std::int16_t> policy_;
    std::vector<double> now_;
    std::vector<double> old_;
    std::vector<Sample> samples_;
    std::vector<std::uint8_t> exists_;
    std::vector<std::size_t> next_play_;
};

}  // namespace palpate::energy_search
