// Solves with a Hessian that is a symmetric matrix, which is factorized, and a remainder: by GMRES, preconditioned with the
// factorization.
#pragma once

#include "magshell/linalg/factor.h"
#include "magshell/linalg/gmres.h"
#include "magshell/scene/model.h"

namespace magshell {

/// Of solves for gradients, to round-off.
constexpr GmresOptions to_round_off{1e-13, 300};

/// Replaces a vector of the free unknowns by K^-1 or K^-T of it; the remainder is the model's, as assembled last.
GmresReport solve_unsymmetric(const Model& model, const Factor& factor, bool transposed,
                              const GmresOptions& options, VectorXd& reduced);

/// The same to round-off, at an equilibrium whose factorization was kept and whose Hessian was assembled last; one that is
/// symmetric takes no iteration. Throws InvalidInput where it does not converge.
void solve_at_equilibrium(const Model& model, const Factor& factor, bool transposed, VectorXd& reduced);

}  // namespace magshell
