// Down from an equilibrium that does not hold any more, to the next one.
//
// Strides: implicit Euler steps of the gradient flow M dq/dt = - dE/dq by mixed iterations, as long as a radius allows, and
// given up at the first sign that they lead nowhere. They take a thin sheet far, stretched nowhere. Where they fail, as
// where a coarse mesh snaps from fold to fold, slides (descent.h): many cheap steps with one factorization. Whatever has
// lowered the energy more a factorization is tried first.
#pragma once

#include "magshell/solve/relaxation.h"

namespace magshell {

RelaxationReport go_downhill(Newton& newton, VectorXd& q, const Controls& controls, int max_steps);

}  // namespace magshell
