// Modes of the Hessian that decide about stability: K v = eigenvalue M v, with the area metric M of the model.
#pragma once

#include "magshell/solve/newton/newton.h"

namespace magshell {

struct Mode {
    double eigenvalue;  // [N/m3], stiffness per area
    VectorXd shape;     // of all dofs, largest displacement 1
};

/// Returns pseudo-random start vectors, the same in every run; no symmetry of a scene is likely to be orthogonal to them.
Eigen::MatrixXd generic_vectors(Index rows, Index columns);

/// Returns the `count` modes with the eigenvalues nearest to zero, ascending, by subspace iteration with the last factorization of
/// `newton`, which must be that of the Hessian itself.
std::vector<Mode> modes_near_zero(Newton& newton, int count);

/// Returns the mode with the most negative eigenvalue at q, where the model was evaluated last and the factorization has this number of
/// negative pivots, and the mode with the next eigenvalue where it was computed as well; without negative pivots, the lowest modes. May
/// leave the factorization of a shifted Hessian behind.
std::vector<Mode> most_unstable_modes(Newton& newton, const VectorXd& q,
                                      const LoadParameters& load_parameters, Index negative_pivots);

}  // namespace magshell
