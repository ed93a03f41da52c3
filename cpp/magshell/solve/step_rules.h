// The numbers of the statics solver. What a rule calls small, good or negligible is one of these; what a rule needs beside them stands at the
// rule.
#pragma once

#include "magshell/scene/model.h"

namespace magshell {

// Displacements over the extent of the bodies [-]. Newton's method squares a small step: after a last step of a thousandth a millionth
// remains, whose square, by which it changes an energy near its minimum, is hidden by round-off; see test_fine_roof_takes_small_steps.
constexpr double settled_step = 1e-3, hidden_part = settled_step * settled_step;
constexpr double negligible_length = 1e-9;  // [-] of a line search; see test_strip_folds_onto_itself
// [-] Round-off of a sum of energies; see test_hard_case_reaches_its_answer.
constexpr double energy_tolerance = 1e-12;
// Displacement over the extent below which a step has settled, at an equilibrium or a saddle. [-] See
// test_a_compressed_strip_leaves_the_saddle.
constexpr double settled_part = 1e-4;

// Factor by which steps grow and shrink [trust regions, N&W 4.1]; its square where a model of the step says that more is needed, its cube
// where nothing is known. [-] See test_a_thin_strip_rolled_up and test_a_semi_cylinder_pulled_and_pushed.
constexpr double step_factor = 2.0;
constexpr double large_factor = step_factor * step_factor, largest_factor = large_factor * step_factor;
// Parts of a whole: a reduction that counts as progress (the curvature condition, N&W 3.1), and agreement with a model that is good
// (N&W 4.1). [-] See test_strip_folds_onto_itself and test_a_semi_cylinder_pulled_and_pushed.
constexpr double progress_part = 1.0 / step_factor, good_part = 1.0 / large_factor;
// Parts that are small beside the whole, and negligible. [-] See test_state_of_an_early_end_is_an_equilibrium.
constexpr double small_part = 0.1, negligible_part = 0.01;

// Attempts at one thing and rounds of one method, at most. See test_small_load_on_a_shallow_roof and test_hard_case_reaches_its_answer.
constexpr int few = 8;
// Iterations without a factorization that cost as much as one: each takes a gradient and two triangular solves. See test_bounded_effort.py
// and test_both_sides_of_a_saddle_cost_the_same.
constexpr int iterations_per_factorization = 20;

/// Returns the largest displacement of a node along an axis [m].
inline double largest_displacement(const Model& model, const VectorXd& step) {
    return step.head(model.n_coordinates()).lpNorm<Eigen::Infinity>();
}

}  // namespace magshell
