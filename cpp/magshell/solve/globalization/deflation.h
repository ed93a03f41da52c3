// Finds further equilibria at the same load parameters, by deflation of Newton's method.  [Farrell, Birkisson, Funke 2015]
//
// Instead of g(q) = 0, the deflated problem M(q) g(q) = 0 is solved. It has all other solutions, but none of the known ones q_i, at which M
// has a pole:
//
//   M(q) = prod_i (1 + (s / |q - q_i|)^2)
//
// The Jacobians differ by a rank-one matrix, so the deflated Newton step is the one of g times a number (Sherman-Morrison):
//
//   p_M = p / (1 - d(ln M) . p)
#pragma once

#include <vector>

#include "magshell/solve/newton/newton.h"

namespace magshell {

/// The equilibria from which the search is kept away.
struct KnownEquilibria {
    const std::vector<VectorXd>& states;
    double length;  // [m] s, as root mean square displacement over the bodies
};

/// Searches from q for a stationary point that is none of the known ones, at load parameters for which the supports are in
/// place. Leaves q at the last state if it fails.
NewtonReport solve_away_from(Newton& newton, VectorXd& q, const LoadParameters& load_parameters,
                             const KnownEquilibria& known, int max_iterations);

}  // namespace magshell
