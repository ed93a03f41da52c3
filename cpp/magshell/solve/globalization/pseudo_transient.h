// The fallback of a static solve: energy descent to a stable equilibrium.
//
// From an equilibrium that has lost its stability, solve/globalization/energy_descent.h. From any other state, if that fails, with contact between bodies
// and with follower loads: pseudo-transient continuation, i.e. implicit Euler steps of the gradient flow M dq/dt = - dE/dq,
// each solved by mixed Newton and accepted only if it lowers the energy. If the Hessian has a negative eigenvalue, 1/dt is kept just
// above its size: the unstable mode then grows several times per step, and the step has one solution. If the Hessian is positive
// definite the steps grow, and Newton's method finishes. If the flow converges to a saddle, the state is displaced along the most
// unstable mode as far as the energy falls.
#pragma once

#include "magshell/solve/newton/newton.h"

namespace magshell {

struct RelaxationReport {
    bool converged = false;
    bool neutral = false;  // stationary, with a singular Hessian
    int steps = 0, saddles_escaped = 0;
    double residual = 0.0;
    double last_displacement = 0.0;  // [m], of the last accepted step
    VectorXd descent_direction;      // the mode along which the energy falls at the end, if one was found
    std::string reason;
};

/// Descends from q to a stable equilibrium at these load parameters. from_rest: q is an equilibrium at load parameters near these.
RelaxationReport relax(Newton& newton, VectorXd& q, const LoadParameters& load_parameters, int max_steps,
                       bool from_rest);

}  // namespace magshell
