// The modes of the Hessian that decide about stability: K v = eigenvalue M v, with the model's area metric M.
#pragma once

#include "magshell/solve/newton.h"

namespace magshell {

struct Mode {
    double eigenvalue;  // [N/m3]: stiffness per area
    VectorXd shape;     // all unknowns, largest displacement 1
};

/// The `count` modes with eigenvalues nearest to zero, ascending, by subspace iteration with the last
/// factorization of `newton`, which must be that of the Hessian itself.
std::vector<Mode> modes_near_zero(Newton& newton, int count);

/// The mode with the most negative eigenvalue at q, which the model was last evaluated at and whose
/// factorization has so many negative pivots; without any, the lowest of all. May leave the factorization of
/// a shifted Hessian behind.
Mode most_unstable_mode(Newton& newton, const VectorXd& q, const Controls& controls, Index negative_pivots);

}  // namespace magshell
