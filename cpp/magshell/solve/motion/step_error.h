// Estimates the error of the positions after one time step by an embedded formula, without a further solve.
//
// The positions at the end of a step are x = x_0 + dt sum_j b_j v_j. A second set of weights, over the velocity v_0 at the beginning
// as well, integrates linear motions to one order more; A has a row of zeros for the beginning:
//
//   b^ . A^k c = 1 / (k + 2)!,  k = -1 ... stages - 1  (A^-1 c = 1),     e = dt sum_j (b_j - b^_j) v_j  [m]
//
// Up to the third order these are all conditions on positions, because dx/dt = v is linear in the state. Implicit Euler
// has e = dt/2 (v_1 - v_0), and TR-BDF2 the estimate of Hosea and Shampine, Appl. Numer. Math. 20 (1996). Across a jump of
// velocity e is of the size dt |dv|.
#pragma once

#include <span>

#include "magshell/solve/motion/stepper.h"

namespace magshell {

/// Numbers for the velocity at the beginning of a step and for those of its stages.
using ErrorWeights = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, Tableau::max_stages + 1, 1>;

/// Returns b - b^, stages + 1 numbers.
ErrorWeights error_weights(const Tableau& tableau);

/// Returns the estimate of a step, root mean square over all vertices and points of rigid bodies [m], each counted alike whatever area it
/// stands for. Prescribed positions have no error, and torque-free rotations none to be seen (free_flight.h). begin: the velocity at the
/// beginning of the step. rates: as the step left them, with those at its beginning if the method begins explicitly.
double step_error(const Model& model, const StepAlgebra& step, const FreeFlight& flight,
                  const VectorXd& begin, std::span<const StageRates> rates);

}  // namespace magshell
