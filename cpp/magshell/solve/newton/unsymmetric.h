// Solves with a nonsymmetric Hessian: GMRES, preconditioned with the factorization of its symmetric part.
#pragma once

#include "magshell/linalg/factor.h"
#include "magshell/linalg/krylov/gmres.h"
#include "magshell/scene/model.h"

namespace magshell {

/// Tolerance and iterations of solves for gradients. [-] Fixed by round-off; see test_gradient_in_flesh_over_200_steps.
constexpr GmresOptions to_round_off{1e-13, 300};

/// Replaces a vector of the free dofs by K^-1 or K^-T of it, with the nonsymmetric tangent that the model assembled last.
GmresReport solve_unsymmetric(const Model& model, const Factor& factor, bool transposed,
                              const GmresOptions& options, VectorXd& reduced);

}  // namespace magshell
