// Energy descent by L-BFGS, preconditioned with one fixed factorization of the Hessian (N&W 7.2).
//
// A Newton step of a thin shell is short, since a displacement that bends the shell also stretches it to second order. From its
// end, L-BFGS steps with the same factorization remove that stretch for the cost of a gradient each, so the next Hessian is one
// without such stresses.
#pragma once

#include <string>

#include "magshell/solve/newton/newton.h"

namespace magshell {

// [-] Increase of the energy that counts as none, over its size; see test_small_load_on_a_shallow_roof.
constexpr double energy_tolerance = 1e-12;
// [-] Decrease of the energy that counts as none, over the one it is compared with: of the first step of a descent, or of the other
// side of a saddle. See test_a_flat_strip_far_beyond_where_it_buckles.
constexpr double negligible_share = 1e-6;
// Attempts at a step, each with a shorter one, at most; see test_small_load_on_a_shallow_roof.
constexpr int max_attempts = 8;

struct LbfgsRound {
    double displacement = 0.0;    // [m] the largest, or 0 if no step lowers the energy
    bool stationary = false;      // whether it ended because the energy no longer falls
    std::string crossing_reason;  // why an obstacle refused a trial, in words; empty if none did
};

/// Descends from q, whose energy is given, with Newton's last factorization, which must be positive definite. Updates q and its energy.
LbfgsRound lbfgs_descent(Newton& newton, VectorXd& q, double& energy, const LoadParameters& load_parameters,
                         int most_steps);

}  // namespace magshell
