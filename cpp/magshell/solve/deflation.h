// Further equilibria at the same controls: Newton's steps deflected away from those already known.
//
// Deflation (Farrell, Birkisson, Funke 2015): instead of g(q) = 0, M(q) g(q) = 0 is solved, which has all other solutions
// and none where M has its poles,
//
//   M(q) = prod_i (1 + (s / |q - q_i|)^2)
//
// and whose Newton step is that of g itself times a number, since the Jacobian differs by a rank-one matrix:
//
//   p_M = p / (1 - d(ln M) . p)                                                          (Sherman, Morrison)
#pragma once

#include <vector>

#include "magshell/solve/newton.h"

namespace magshell {

/// What to stay away from.
struct Known {
    const std::vector<VectorXd>& states;
    double reach;  // [m], s: root mean square over the bodies
};

/// From q to a stationary point at the controls, where held nodes must be already, that is none of `known`; or to where it
/// failed.
NewtonReport solve_away_from(Newton& newton, VectorXd& q, const Controls& controls, const Known& known,
                             int max_iterations);

}  // namespace magshell
