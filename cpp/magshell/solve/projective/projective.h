// Projective Dynamics: stages of implicit Euler whose matrix stays factorized.
//
// For energies sum_i w_i/2 |G_i q - p_i(q)|^2, with p_i the projection of G_i q onto a constraint set, the local step computes all p_i,
// and the global step solves                                                      [Qiao21] (3)-(5), Algorithm 1
//
//   (M/dt^2 + L) q = M/dt^2 s + J p,    L = sum_i w_i G_i^T G_i
//
// Since p_i is the nearest point, dE/dq = sum_i w_i G_i^T (G_i q - p_i), and both steps together are the quasi-Newton step
//
//   q <- q - (M/dt^2 + L)^-1 r(q)                                           [Liu, Bouaziz, Kavan 2017]
//
// with the residual r of implicit Euler. Evaluating the forces of the terms is therefore the local step, and any energy can be used
// for which a constant matrix L is stiff enough. L-BFGS corrects the matrix by the last few steps (solve/globalization/lbfgs_history.h),
// and a line search ends a step where the energy begins to rise. Contact between bodies is stiff and changes, so it is added to the
// matrix in every iteration by a low-rank update (solve/projective/contact_woodbury.h).
#pragma once

#include <memory>
#include <optional>

#include "magshell/solve/newton/newton.h"
#include "magshell/solve/projective/contact_woodbury.h"
#include "magshell/solve/projective/coulomb_contact.h"

namespace magshell {

struct ProjectiveOptions {
    bool on = false;
    int iterations = 0;      // most iterations; without a tolerance exactly this number
    double tolerance = 0.0;  // [-] of the residual, as in NewtonOptions; 0: none
    int history = 0;         // pairs of the L-BFGS history; 0: no correction of the matrix
    bool coulomb = false;    // hard contact with Coulomb friction, solve/projective/coulomb_contact.h
};

class ProjectiveSolver {
  public:
    ProjectiveSolver(Newton& newton, const ProjectiveOptions& options);

    /// Solves from q for a stationary point at these load parameters, or leaves q where it failed, as Newton::solve does. scale:
    /// factor of the elastic stiffness, see ViscousTerms::set_history.
    NewtonReport solve(VectorXd& q, const LoadParameters& load_parameters, const ProximalTerm& proximal,
                       double scale);

  private:
    NewtonReport solve_smooth(VectorXd& q, const LoadParameters& load_parameters,
                              const ProximalTerm& proximal, double scale);
    /// Solves with Coulomb contact in each iteration.
    NewtonReport solve_with_coulomb(VectorXd& q, const LoadParameters& load_parameters,
                                    const ProximalTerm& proximal, double scale);
    /// Returns true if the contact stiffness of obstacles has changed by much since it was `before`, and then updates `before`.
    bool contact_stiffness_changed(const ProximalTerm& proximal, VectorXd& before) const;
    void prepare(const VectorXd& q, const ProximalTerm& proximal, double scale);
    VectorXd reduced_gradient(const VectorXd& q, const ProximalTerm& proximal) const;

    Newton& newton_;
    Model& model_;
    ProjectiveOptions options_;
    ConstantMatrix matrix_;
    ContactWoodbury touching_;
    std::optional<ScopedContactOff> aside_;  // engaged with Coulomb friction
};

}  // namespace magshell
