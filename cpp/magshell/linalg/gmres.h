// GMRES for matrices that are a symmetric one, which is factorized, and little else.
//
// Preconditioned from the right, so that the residual is that of the system itself; never restarted, as a few
// dozen vectors are all it takes.                                                 [Saad and Schultz 1986]
#pragma once

#include <functional>

#include "magshell/core/types.h"

namespace magshell {

struct GmresReport {
    bool converged = false;
    int iterations = 0;
    double residual = 0.0;  // over the norm of the right-hand side
};

struct GmresOptions {
    double tolerance = 1e-12;  // of the residual, over the norm of the right-hand side
    int max_iterations = 200;
};

/// Replaces the right-hand side by the solution. `product` gives A x, `precondition` replaces x by P^-1 x.
GmresReport gmres(const std::function<VectorXd(const VectorXd&)>& product,
                  const std::function<void(VectorXd&)>& precondition, VectorXd& rhs,
                  const GmresOptions& options);

}  // namespace magshell
