// The fallback that always descends: pseudo-transient continuation.
//
// Implicit Euler steps of the gradient flow M dq/dt = - dE/dq, each solved by the mixed Newton. A step is kept only
// if it lowers the energy; the time step grows while they converge quickly, and shrinks when one does not. Close to a
// minimum, where the Hessian is positive definite, Newton itself finishes.
#pragma once

#include "magshell/solve/newton.h"

namespace magshell {

struct RelaxationReport {
    bool converged = false;
    int steps = 0;
    double residual = 0.0;
    std::string reason;
};

/// From q down to a stable equilibrium at the controls. `rate` [N/m3] is the weight of the first steps.
RelaxationReport relax(Newton& newton, VectorXd& q, const Controls& controls, double rate, int max_steps = 200);

}  // namespace magshell
