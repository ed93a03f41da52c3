// The numbers that rules of the statics solver share: how large a step, a residual or an energy they call small, good or negligible. A number
// that one rule alone needs is defined beside that rule.
#pragma once

#include "magshell/scene/model.h"

namespace magshell {

// Displacements over the extent of the bodies [-]: the longest last step of a converged Newton iteration, and its square, the error that is
// left after it. Such an error changes an energy near its minimum by its own square, which is round-off of a sum of energies. The cube is no
// step any more. See test_fine_roof_takes_small_steps, test_hard_case_reaches_its_answer and test_strip_folds_onto_itself.
constexpr double settled_step = 1e-3, hidden_part = settled_step * settled_step;
constexpr double negligible_length = hidden_part * settled_step, energy_tolerance = hidden_part * hidden_part;

// [-] Factor by which steps grow and shrink (trust regions, N&W 4.1). Its square limits changes that an estimate asks for, its cube serves
// where there is none. See test_a_thin_strip_rolled_up and test_a_semi_cylinder_pulled_and_pushed.
constexpr double step_factor = 2.0;
constexpr double large_factor = step_factor * step_factor, largest_factor = large_factor * step_factor;
// [-] Ratio of residuals or slopes below which a step makes progress (curvature condition, N&W 3.1), and fraction of a predicted decrease
// above which the model is good (N&W 4.1). See test_strip_folds_onto_itself and test_a_semi_cylinder_pulled_and_pushed.
constexpr double progress_part = 1.0 / step_factor, good_part = 1.0 / large_factor;
// Parts that are small beside the whole, and negligible. [-] See test_state_of_an_early_end_is_an_equilibrium.
constexpr double small_part = 1.0 / largest_factor, negligible_part = small_part * small_part;
// [-] Displacement over the extent below which a descent has settled: the Hessian then tells an equilibrium from a saddle. It is the shortest
// step length of full Newton steps, too. See test_a_compressed_strip_leaves_the_saddle.
constexpr double settled_part = small_part * settled_step;

// Largest number of trials, attempts or rounds of a method. See test_small_load_on_a_shallow_roof and test_hard_case_reaches_its_answer.
constexpr int few = 8;
// Iterations without a factorization that count as one in a budget: each takes a gradient and two triangular solves. See
// test_bounded_effort.py and test_both_sides_of_a_saddle_cost_the_same.
constexpr int iterations_per_factorization = 20;

/// Returns the largest displacement of a node along an axis [m].
inline double largest_displacement(const Model& model, const VectorXd& step) {
    return step.head(model.n_coordinates()).lpNorm<Eigen::Infinity>();
}

}  // namespace magshell
