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

/// dm + du with K du = g(unloaded) - g(controls) - K dm, all of all unknowns: K is the Hessian, g the gradient at the rest
/// shape q, K unloaded, and dm what supports and motors move. at_rest, where it is given, takes the place of g(unloaded).
/// What nothing but zeros couples with a force stays at rest, and need not be held. Throws InvalidInput where K is not
/// symmetric.
SmallDeflection small_deflection(Model& model, const VectorXd& q, const Controls& unloaded,
                                 const Controls& controls, const std::optional<VectorXd>& at_rest = {});

}  // namespace magshell
