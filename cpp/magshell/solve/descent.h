// Downhill in energy with one factorization: steps of L-BFGS, with it in the place of the unit matrix.
//
// A Newton step of a thin sheet is short, as it stretches what it bends. From its end further steps with the same
// factorization undo that, at the cost of a gradient each, and the next Hessian is one without such stresses.
#pragma once

#include "magshell/solve/newton.h"

namespace magshell {

/// From q, whose energy this is, with the last factorization, which must be positive definite; both as they end. How far
/// what moved most has moved [m]: 0 where no step lowers the energy.
double descend(Newton& newton, VectorXd& q, double& energy, const Controls& controls, int most_steps);

}  // namespace magshell
