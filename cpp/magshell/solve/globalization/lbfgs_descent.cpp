#include "magshell/solve/globalization/lbfgs_descent.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "magshell/solve/globalization/lbfgs_history.h"
#include "magshell/solve/newton/newton_iteration.h"

namespace magshell {
namespace {

// [-] Number of steps whose curvature is stored; see test_both_sides_of_a_saddle_cost_the_same.
constexpr std::size_t descent_history = 12;
// [-] Smallest fraction of a rejected step that is tried next; see test_a_semi_cylinder_pulled_and_pushed.
constexpr double min_backtrack = 0.05;

/// A state with its energy, its reduced gradient, and the branches of its angles.
struct DescentState {
    VectorXd q, gradient;
    double energy;
    Model::AngleBranches angle_branches;
};

class Descent {
  public:
    Descent(Newton& newton, const LoadParameters& load_parameters, const VectorXd& q, double energy)
        : newton_(newton),
          model_(newton.model()),
          load_parameters_(load_parameters),
          history_(descent_history) {
        model_.evaluate(q, load_parameters_);
        here_ = at(q, energy);
    }

    const DescentState& run() {
        double first = 0.0;  // twice the decrease of the energy that the first step predicts
        for (int k = 0; k < iterations_per_factorization; ++k, newton_.count_iteration()) {
            newton_.watch(newton_.relative_residual(here_.q, {}));
            const VectorXd d = direction();
            const double slope = here_.gradient.dot(d), before = here_.energy;
            if (k == 0) first = -slope;
            if (!(slope < 0.0)) break;
            stationary_ = -slope < hidden_part * first;
            if (stationary_ || !line_search_along(d, slope)) break;
            stationary_ = before - here_.energy <= energy_tolerance * std::abs(before);
            if (stationary_) break;
        }
        model_.set_angle_branches(here_.angle_branches);
        return here_;
    }

    bool stationary() const { return stationary_; }
    const std::string& crossing_reason() const { return crossing_reason_; }

  private:
    // Returns the L-BFGS direction at the current state.
    VectorXd direction() const {
        VectorXd d = -here_.gradient;
        history_.solve(d, [&](VectorXd& g) { newton_.factor()->solve(g); });
        return d;
    }

    // Returns the state at which the model was evaluated last.
    DescentState at(const VectorXd& q, double energy) const {
        return {q, model_.dof_map().vector(model_.residual().gradient), energy, model_.angle_branches()};
    }

    // Searches along d for a state at which the energy no longer falls fast. Returns false if the energy does not fall.
    bool line_search_along(const VectorXd& d, double slope) {
        const VectorXd step = model_.dof_map().expand(d);
        const double length = largest_displacement(model_, step);
        if (!std::isfinite(length)) return false;
        double max_alpha = std::min(large_factor, small_part * model_.extent() / length);
        if (model_.capabilities().has_infeasible_states) {
            const double asked = std::max(1.0, max_alpha);
            max_alpha = std::min(max_alpha,
                                 asked * model_.capabilities().admissible_step_length(here_.q, asked * step));
        }
        const double allowed = energy_tolerance * std::abs(here_.energy);
        double alpha = std::min(1.0, max_alpha), last = 0.0, last_slope = slope, accepted_alpha = 0.0;
        bool too_far = false;
        DescentState end;
        for (int trial = 0; trial < few; ++trial) {
            VectorXd there = here_.q;
            model_.dof_map().retract(there, alpha * step);
            const double energy = model_.energy(there, load_parameters_), change = energy - here_.energy;
            std::string crossing =
                model_.capabilities().crossing_reason(here_.q, load_parameters_, there, load_parameters_);
            const bool crosses = !crossing.empty();
            if (crosses) crossing_reason_ = std::move(crossing);
            if (crosses || !(change <= allowed)) {
                if (accepted_alpha > 0.0) break;
                too_far = true;
                const double bottom =
                    std::isfinite(change) ? -0.5 * slope * alpha * alpha / (change - slope * alpha) : 0.0;
                alpha = std::clamp(bottom, min_backtrack * alpha, progress_part * alpha);
                continue;
            }
            if (accepted_alpha > 0.0 && !(energy < end.energy)) break;
            model_.evaluate(there, load_parameters_);
            end = at(there, energy);
            accepted_alpha = alpha;
            const double slope_there = end.gradient.dot(d);
            if (slope_there > progress_part * slope || alpha >= max_alpha || too_far) break;
            // The energy still falls fast: extrapolates its slope linearly to find a longer step.
            const double flatter = slope_there - last_slope;
            const double secant = flatter > 0.0 ? alpha - slope_there * (alpha - last) / flatter : max_alpha;
            last = alpha;
            last_slope = slope_there;
            alpha = std::min({secant, large_factor * alpha, max_alpha});
        }
        if (accepted_alpha == 0.0) return false;
        history_.add(accepted_alpha * d, end.gradient - here_.gradient);
        here_ = std::move(end);
        return true;
    }

    Newton& newton_;
    Model& model_;
    const LoadParameters& load_parameters_;
    LbfgsHistory history_;
    DescentState here_;
    bool stationary_ = false;  // whether the energy no longer falls
    std::string crossing_reason_;
};

}  // namespace

LbfgsRound lbfgs_descent(Newton& newton, VectorXd& q, double& energy, const LoadParameters& load_parameters) {
    Descent descent(newton, load_parameters, q, energy);
    const DescentState& end = descent.run();
    const double moved = largest_displacement(newton.model(), end.q - q);
    q = end.q;
    energy = end.energy;
    return {moved, descent.stationary(), descent.crossing_reason()};
}

}  // namespace magshell
