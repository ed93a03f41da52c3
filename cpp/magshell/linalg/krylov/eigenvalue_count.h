// Counts the eigenvalues of A^-1 H below a bound, for a positive definite A that is known by its solves and a symmetric H that is known by
// its products.
#pragma once

#include <cstddef>
#include <functional>

#include "magshell/core/types.h"

namespace magshell {

/// The outcome of Lanczos' method.
struct EigenvalueCount {
    Index below = 0;       // eigenvalues below the bound, equal ones counted once
    bool settled = false;  // whether the next one is known to lie above it
    double margin =
        0.0;  // [-] distance of the nearest one from the bound, over the size of the largest one, or over 1
    std::size_t bytes = 0;         // of the vectors that the count took
    Eigen::MatrixXd directions{};  // (n, below) approximations of their eigenvectors, if they are wanted
};

/// Counts by Lanczos' method in the inner product of A, with full orthogonalization. An eigenvalue is missed with an estimated probability
/// of 1e-3. diagonal: of A, so that unknowns of all units take part in the start.
EigenvalueCount count_below(const std::function<void(VectorXd&)>& solve, const VectorXd& diagonal,
                            const std::function<VectorXd(const VectorXd&)>& product, double bound,
                            bool with_directions = false);

}  // namespace magshell
