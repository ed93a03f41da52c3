// What a solution leaves of a linear system, in more digits than it has.
#pragma once

#include "magshell/linalg/factor.h"

namespace magshell {

/// b - A x, from the values of the lower triangle of A, added up in as many digits as the machine has.
VectorXd residual(const SparsePattern& pattern, const double* values, const VectorXd& x, const VectorXd& b);

}  // namespace magshell
