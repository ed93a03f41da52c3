// Energy descent by L-BFGS, preconditioned with one fixed factorization of the Hessian (N&W 7.2).
//
// A Newton step of a thin shell is short, since a displacement that bends the shell also stretches it to second order. From its
// end, L-BFGS steps with the same factorization remove that stretch for the cost of a gradient each, so the next Hessian is one
// without such stresses.
#pragma once

#include <string>

#include "magshell/solve/newton/newton.h"

namespace magshell {

struct LbfgsRound {
    double displacement = 0.0;    // [m] the largest, or 0 if no step lowers the energy
    bool stationary = false;      // whether it ended because the energy no longer falls
    std::string crossing_reason;  // why an obstacle refused a trial, in words; empty if none did
};

/// Descends from q, whose energy is given, with Newton's last factorization, which must be positive definite, in steps that together cost as
/// much as that factorization. Updates q and its energy.
LbfgsRound lbfgs_descent(Newton& newton, VectorXd& q, double& energy, const LoadParameters& load_parameters);

}  // namespace magshell
