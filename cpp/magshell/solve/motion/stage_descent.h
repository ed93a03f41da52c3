// Descent of a time stage, where full Newton steps fail since contacts open and close, stick and slip: slower, and robust.
#pragma once

#include "magshell/solve/newton/newton.h"

namespace magshell {

/// Solves a time stage from q in rounds: steps that lower its energy with fixed normal forces of friction, then standard Newton iterations by
/// this policy, which has a proximal term. Leaves q at the last state if it fails.
NewtonReport descend_in_rounds(Newton& newton, VectorXd& q, const LoadParameters& load_parameters,
                               const NewtonPolicy& policy);

}  // namespace magshell
