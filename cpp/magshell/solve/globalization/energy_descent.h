// Descends from an equilibrium that has lost its stability to a stable equilibrium nearby.
//
// Two methods compete. (1) Gradient flow steps: implicit Euler steps of the gradient flow M dq/dt = - dE/dq, i.e. pseudo-transient
// continuation [Kelley & Keyes 1998], solved by mixed Newton iterations, limited to a trust radius, and given up as soon as they
// do not converge. They move a thin shell far without stretching it. (2) Where they fail, for example where a coarse mesh
// snaps from fold to fold: up to 20 cheap L-BFGS steps with one factorization (solve/globalization/lbfgs_descent.h). The method with the larger
// decrease of the energy per factorization is tried first.
#pragma once

#include "magshell/solve/globalization/pseudo_transient.h"

namespace magshell {

/// Descends from q, an equilibrium at load parameters near these, in at most max_steps steps.
RelaxationReport descend_to_stable(Newton& newton, VectorXd& q, const LoadParameters& load_parameters,
                                   int max_steps);

}  // namespace magshell
