// The fallback that always descends: pseudo-transient continuation.
//
// Implicit Euler steps of the gradient flow M dq/dt = - dE/dq, each solved by the mixed Newton and kept only if it
// lowers the energy. Where the Hessian has a negative eigenvalue, 1/dt stays just above its size: the unstable mode then
// grows several times a step, and the step still has one solution. Where it is positive definite the steps get longer and
// longer, and Newton itself finishes.
#pragma once

#include "magshell/solve/newton.h"

namespace magshell {

struct RelaxationReport {
    bool converged = false;
    int steps = 0;
    double residual = 0.0;
    std::string reason;
};

/// From q down to an equilibrium at the controls, which may be a saddle where the start has its symmetry.
RelaxationReport relax(Newton& newton, VectorXd& q, const Controls& controls, int max_steps = 200);

}  // namespace magshell
