// The adjoint of an equilibrium g(q, k) = 0, with q_f the free unknowns and q_h what supports hold.
//
//   H_ff lambda_f = - dF/dq_f,      dF/dk = lambda^T dg/dk + (dF/dq_h + H_hf lambda_f)^T dq_h/dk
//
// with H transposed where loads that follow make it unsymmetric. One back-substitution with the factorization that found the equilibrium stable serves all k.
// What motors do is g . B z along the joints that they drive, with z the gradient by it: lambda + B z takes lambda's place.
#pragma once

#include "magshell/solve/statics.h"

namespace magshell {

/// dF/dk from dF/dq, a vector of all unknowns, and from the gradients by what motors do there, as
/// Reduction::driving has it, or none; at an equilibrium whose factor was kept. The model must hold
/// the values that the equilibrium was found with. Throws InvalidInput where no factor was kept.
Gradient pull_back(Model& model, const StaticsResult& equilibrium, const VectorXd& by_state,
                   const VectorXd& by_driving = {});

}  // namespace magshell
