// Proximal continuation: descends to a stable equilibrium at fixed load parameters.
//
// A step from q minimizes E(x) + shift/2 |x - q|^2 in the norm of the area metric: an implicit Euler step of the gradient flow with
// shift = 1/dt, or the proximal point algorithm [Rockafellar 1976]. The matrix H + shift M is made positive definite by raising the
// shift, as [Waechter, Biegler 2006] correct the inertia, and its Newton step p is compared with the energy:
//
//   rho = (E(q) - E(q + p)) / (decrease that the quadratic model predicts)
//
//   rho good   up to 20 steps of L-BFGS with this one factorization (quasi-Newton rounds [Matthies, Strang 1979])
//   otherwise  mixed Newton iterations to the proximal point, given up at the first sign of instability. They bend a thin shell far
//              without regard to the energy between, which membrane strains would dominate.
//
// Success lowers the shift, down to zero, where the iteration is Newton's method for the equilibrium itself; failure raises it so that the
// step becomes shorter [Hebden 1973]. Where L-BFGS ends because the energy no longer falls, the Hessian without a shift decides. A
// stationary state with negative pivots is a saddle: it is left along its lowest mode, to the side where the energy falls deeper.
#pragma once

#include <string>
#include <vector>

#include "magshell/solve/newton/newton.h"
#include "magshell/solve/solve_log.h"

namespace magshell {

/// A way out of a saddle that a descent did not take, though round-off decided between it and the way taken.
struct OtherBranch {
    VectorXd saddle, state;  // the saddle, and a state of lower energy on that way
    bool other_mode;         // whether it follows another mode, or the other side of the same one
};

struct RelaxationReport {
    bool converged = false;
    bool neutral = false;  // stationary, with a singular Hessian
    int steps = 0, saddles_escaped = 0;
    std::vector<OtherBranch> other_branches;
    double residual = 0.0;
    FactorReport factor;             // of the Hessian at the end, if converged
    double last_displacement = 0.0;  // [m], of the last accepted step
    VectorXd descent_direction;      // the mode along which the energy falls at the end, if one was found
    std::string reason;
};

/// Descends from q to a stable equilibrium at these load parameters, in at most max_steps steps. Moves prescribed nodes to their targets
/// first, and leaves q at the last state. Appends its steps to the log, also if it is interrupted.
RelaxationReport proximal_continuation(Newton& newton, VectorXd& q, const LoadParameters& load_parameters,
                                       int max_steps, SolveLog& log);

}  // namespace magshell
