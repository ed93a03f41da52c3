// Descends from an equilibrium that has lost its stability to a stable equilibrium nearby.
//
// Every step is taken by one of two methods; the one that decreased the energy more per factorization so far is tried first.
// (1) Gradient flow: an implicit Euler step of M dq/dt = - dE/dq, i.e. pseudo-transient continuation [Kelley & Keyes 1998], with M the area
//     metric. It is solved by mixed Newton iterations, limited to a trust radius, and given up as soon as they do not converge. Such a step
//     moves a thin shell far without stretching it. It fails, for example, if a coarse mesh snaps from fold to fold.
// (2) L-BFGS: up to 20 cheap steps preconditioned with one factorization (solve/globalization/lbfgs_descent.h).
#pragma once

#include "magshell/solve/globalization/pseudo_transient.h"

namespace magshell {

/// Descends to a stable equilibrium at these load parameters in at most max_steps steps. q must be an equilibrium at load parameters near
/// these; it is moved to the last state.
RelaxationReport descend_to_stable(Newton& newton, VectorXd& q, const LoadParameters& load_parameters,
                                   int max_steps);

}  // namespace magshell
