#include "magshell/solve/descent.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace magshell {
namespace {

constexpr std::size_t most_pairs = 12;
constexpr double longest_way = 0.1;                       // of the extent
constexpr double longest_part = 4.0;                      // of a step
constexpr double falls_enough = 1e-4, flat_enough = 0.5;  // of the slope at the beginning of a step
constexpr int most_trials = 8;
constexpr double energy_round_off = 1e-13;  // of an energy
constexpr double little_gained = 1e-6;      // of what the first step was to lower the energy by
constexpr double least_curvature = 1e-10;   // cosine between a step and what it changed

/// What L-BFGS knows of the Hessian; all vectors are reduced.
class Learned {
  public:
    explicit Learned(const Newton& newton) : newton_(newton) {}

    VectorXd direction(const VectorXd& gradient) const {
        VectorXd d = -gradient;
        std::vector<double> shares(pairs_.size());
        for (std::size_t k = pairs_.size(); k-- > 0;) {
            shares[k] = pairs_[k].inverse * pairs_[k].step.dot(d);
            d -= shares[k] * pairs_[k].change;
        }
        newton_.factor()->solve(d);
        for (std::size_t k = 0; k < pairs_.size(); ++k)
            d += (shares[k] - pairs_[k].inverse * pairs_[k].change.dot(d)) * pairs_[k].step;
        return d;
    }

    void learn(VectorXd step, VectorXd change) {
        const double product = step.dot(change);
        if (!(product > least_curvature * step.norm() * change.norm())) return;
        if (pairs_.size() == most_pairs) pairs_.erase(pairs_.begin());
        pairs_.push_back({std::move(step), std::move(change), 1.0 / product});
    }

    bool empty() const { return pairs_.empty(); }
    void forget() { pairs_.clear(); }

  private:
    struct Pair {
        VectorXd step, change;
        double inverse;  // of their product
    };

    const Newton& newton_;
    std::vector<Pair> pairs_;
};

/// A state with its energy, its gradient, and the terms' turns.
struct Place {
    VectorXd q, gradient;
    double energy;
    Model::Turns turns;
};

class Descent {
  public:
    Descent(Newton& newton, const Controls& controls, const VectorXd& q, double energy)
        : newton_(newton), model_(newton.model()), controls_(controls), learned_(newton) {
        model_.evaluate(q, controls_);
        here_ = at(q, energy);
    }

    const Place& run(int most_steps) {
        double first = 0.0;  // by what the first step was to lower the energy, twice
        for (int k = 0; k < most_steps; ++k, newton_.count_iteration()) {
            newton_.watch(newton_.relative_residual(here_.q, {}));
            VectorXd d = learned_.direction(here_.gradient);
            double slope = here_.gradient.dot(d);
            if (!(slope < 0.0) && !learned_.empty()) {
                learned_.forget();
                d = learned_.direction(here_.gradient);
                slope = here_.gradient.dot(d);
            }
            if (k == 0) first = -slope;
            if (!(slope < 0.0) || -slope < little_gained * first) break;
            const double before = here_.energy;
            if (!go(d, slope)) {
                model_.set_turns(here_.turns);
                model_.evaluate(here_.q, controls_);
                if (learned_.empty()) break;
                learned_.forget();
            } else if (before - here_.energy <= energy_round_off * std::abs(before)) {
                break;
            }
        }
        model_.set_turns(here_.turns);
        return here_;
    }

  private:
    // Where the model was evaluated last.
    Place at(const VectorXd& q, double energy) const {
        return {q, model_.reduction().vector(model_.residual().gradient), energy, model_.turns()};
    }

    // Along d, to where the energy has stopped falling fast; false where it does not fall.
    bool go(const VectorXd& d, double slope) {
        const VectorXd step = model_.reduction().expand(d);
        const double length = step.head(model_.n_coordinates()).lpNorm<Eigen::Infinity>();
        if (!std::isfinite(length)) return false;
        double most = std::min(longest_part, longest_way * model_.extent() / length);
        if (model_.refuses_states()) {
            const double asked = std::max(1.0, most);
            most = std::min(most, asked * model_.share_of_step(here_.q, asked * step));
        }
        const double allowed = energy_round_off * std::abs(here_.energy);
        double part = std::min(1.0, most), last = 0.0, last_slope = slope, best = 0.0;
        bool too_far = false;
        Place end;
        for (int trial = 0; trial < most_trials; ++trial) {
            VectorXd there = here_.q;
            model_.reduction().advance(there, part * step);
            const double energy = model_.energy(there, controls_), change = energy - here_.energy;
            const bool through = !model_.blocked(here_.q, controls_, there, controls_).empty();
            if (through || !(change <= falls_enough * part * slope + allowed)) {
                if (best > 0.0) break;
                too_far = true;
                const double bottom =
                    std::isfinite(change) ? -0.5 * slope * part * part / (change - slope * part) : 0.0;
                part = std::clamp(bottom, 0.05 * part, 0.5 * part);
                continue;
            }
            if (best > 0.0 && !(energy < end.energy)) break;
            model_.evaluate(there, controls_);
            end = at(there, energy);
            best = part;
            const double slope_there = end.gradient.dot(d);
            if (slope_there > flat_enough * slope || part >= most || too_far) break;
            // Still falling fast: further, by the secant.
            const double flatter = slope_there - last_slope;
            const double secant = flatter > 0.0 ? part - slope_there * (part - last) / flatter : most;
            last = part;
            last_slope = slope_there;
            part = std::min(most, std::clamp(secant, 1.5 * part, 4.0 * part));
        }
        if (best == 0.0) return false;
        learned_.learn(best * d, end.gradient - here_.gradient);
        here_ = std::move(end);
        return true;
    }

    Newton& newton_;
    Model& model_;
    const Controls& controls_;
    Learned learned_;
    Place here_;
};

}  // namespace

double descend(Newton& newton, VectorXd& q, double& energy, const Controls& controls, int most_steps) {
    Descent descent(newton, controls, q, energy);
    const Place& end = descent.run(most_steps);
    const double moved = (end.q - q).head(newton.model().n_coordinates()).lpNorm<Eigen::Infinity>();
    q = end.q;
    energy = end.energy;
    return moved;
}

}  // namespace magshell
