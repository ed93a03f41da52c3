// Finds further equilibria at the same load parameters, by deflation of Newton's method.  [Farrell, Birkisson, Funke 2015]
//
// Instead of g(q) = 0, with g the gradient of the energy, the deflated problem M(q) g(q) = 0 is solved. Its solutions are those of g = 0
// without the known ones q_i, because M has a pole there:
//
//   M(q) = prod_i (1 + (s / |q - q_i|)^2)
//
// The Jacobians of both problems differ by a factor and a rank-one matrix. By the Sherman-Morrison formula the deflated Newton step p_M is the
// Newton step p of g = 0 times a number:
//
//   p_M = p / (1 - d(ln M) . p)
#pragma once

#include <vector>

#include "magshell/solve/newton/newton.h"

namespace magshell {

/// The known equilibria q_i, and the length s at which their deflation acts.
struct KnownEquilibria {
    const std::vector<VectorXd>& states;
    double length;  // [m] s, as root mean square displacement over the bodies
};

/// Searches from q for a stationary point that is none of the known ones, at load parameters for which the supports are in
/// place. Leaves q at the last state if it fails.
NewtonReport solve_away_from(Newton& newton, VectorXd& q, const LoadParameters& load_parameters,
                             const KnownEquilibria& known, int max_iterations);

}  // namespace magshell
