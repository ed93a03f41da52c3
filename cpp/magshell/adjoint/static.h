// The adjoint of an equilibrium g(q, k) = 0, with the free dofs q_f and the prescribed ones q_h:
//
//   H_ff lambda_f = - dF/dq_f,      dF/dk = lambda^T dg/dk + (dF/dq_h + H_hf lambda_f)^T dq_h/dk
//
// H is transposed if follower loads make it nonsymmetric. One solve with the factorization that showed the equilibrium stable gives the
// gradients with respect to all k. Motor forces are g . B z along the prescribed joints; for a gradient z by them, lambda + B z replaces
// lambda.
#pragma once

#include "magshell/adjoint/rest_gradient.h"
#include "magshell/solve/statics.h"

namespace magshell {

/// Returns dF/dk from dF/dq, of all dofs, and from the gradient with respect to the motor forces, in the order of DofMap::motor_forces, or
/// none. The equilibrium must have a stored factorization, and the model the parameters that it was found with. Throws InvalidInput without
/// a factorization. rest: filled in if asked for.
Gradient equilibrium_vjp(Model& model, const StaticsResult& equilibrium, const VectorXd& by_state,
                         const VectorXd& by_motor_forces, RestGradient& rest);

}  // namespace magshell
