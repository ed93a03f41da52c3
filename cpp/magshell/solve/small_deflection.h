// How a scene at rest gives way to small forces: linear theory, by one factorization.
#pragma once

#include <optional>

#include "magshell/scene/model.h"

namespace magshell {

struct SmallDeflection {
    VectorXd motion;      // of all unknowns; empty where the stiffness is not positive definite
    FactorReport report;  // of the factorization
    Index unknowns = 0;   // of the matrix that was factorized
};

/// K du = at_rest - gradient, all of all unknowns: K is the Hessian at the rest shape q under these controls, and so is
/// at_rest the gradient there unless it is given. What nothing but zeros couples with a force stays at rest, and need not be
/// held. Throws InvalidInput where K is not symmetric.
SmallDeflection small_deflection(Model& model, const VectorXd& q, const Controls& controls,
                                 const VectorXd& gradient, const std::optional<VectorXd>& at_rest = {});

}  // namespace magshell
