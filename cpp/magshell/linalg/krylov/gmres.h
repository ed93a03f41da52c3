// GMRES for matrices that are close to a factorized symmetric one.
//
// It is preconditioned from the right, so that the residual is that of the system itself, and never restarted,
// since a few dozen vectors suffice.                                                 [Saad and Schultz 1986]
#pragma once

#include <functional>

#include "magshell/core/types.h"

namespace magshell {

struct GmresReport {
    bool converged = false;
    int iterations = 0;
    double residual = 0.0;  // relative to the norm of the right-hand side
};

struct GmresOptions {
    double tolerance = 1e-12;  // of the residual, relative to the norm of the right-hand side
    int max_iterations = 200;
};

/// Replaces the right-hand side by the solution. `product` returns A x, `precondition` replaces x by P^-1 x.
GmresReport gmres(const std::function<VectorXd(const VectorXd&)>& product,
                  const std::function<void(VectorXd&)>& precondition, VectorXd& rhs,
                  const GmresOptions& options);

}  // namespace magshell
