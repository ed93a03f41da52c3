// The fallback that always descends, to a stable equilibrium.
//
// From an equilibrium that does not hold any more: downhill.h. From anywhere else, where that fails, where bodies touch, and
// where loads follow them: pseudo-transient continuation, implicit Euler steps of the gradient flow M dq/dt = - dE/dq,
// each solved by the mixed Newton and kept only if it lowers the energy. Where the Hessian has a negative eigenvalue, 1/dt
// stays just above its size: the unstable mode then grows several times a step, and the step still has one solution.
// Where it is positive definite the steps get longer and longer, and Newton itself finishes. Where the flow settles on a
// saddle, it is pushed off along the most unstable mode, as far as the energy falls.
#pragma once

#include "magshell/solve/newton.h"

namespace magshell {

struct RelaxationReport {
    bool converged = false;
    bool neutral = false;  // at rest, and its Hessian is singular
    int steps = 0, saddles_left = 0;
    double residual = 0.0;
    double last_move = 0.0;  // [m], of the last step that was taken
    VectorXd falling;        // the mode along which the energy falls at the end, if one was found
    std::string reason;
};

/// From q down to a stable equilibrium at the controls. from_rest: q is an equilibrium at controls not far from these.
RelaxationReport relax(Newton& newton, VectorXd& q, const Controls& controls, int max_steps, bool from_rest);

}  // namespace magshell
