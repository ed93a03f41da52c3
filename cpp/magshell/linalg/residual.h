// The residual of a linear system in extended precision.
#pragma once

#include "magshell/linalg/factor.h"

namespace magshell {

/// Returns b - A x from the values of the lower triangle of A, summed in the machine's long double precision.
VectorXd residual(const SparsePattern& pattern, const double* values, const VectorXd& x, const VectorXd& b);

}  // namespace magshell
