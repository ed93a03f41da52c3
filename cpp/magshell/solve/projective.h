// Projective Dynamics: the stages of implicit Euler with a matrix that stays factorized.
//
// Of energies sum_i w_i/2 |G_i q - p_i(q)|^2, p_i the projection of G_i q, a local step finds all p_i and a global one solves
// (M/dt^2 + L) q = M/dt^2 s + J p, L = sum w_i G_i^T G_i.                          [Qiao21] (3)-(5), Algorithm 1
// As p_i is the nearest point, dE/dq = sum w_i G_i^T (G_i q - p_i), and the round is
//
//   q <- q - (M/dt^2 + L)^-1 r(q)                                           [Liu, Bouaziz, Kavan 2017]
//
// with the residual r of implicit Euler that Newton has too: a quasi-Newton step. So terms evaluate their forces, which is
// the local step, and any energy will do for which a constant L is stiff enough. The last few steps correct the matrix
// (solve/secants.h), and a step ends where the energy has begun to rise along it. Bodies that touch each other are stiff,
// and nothing of them is constant: they add to the matrix in every round (solve/touching_matrix.h).
#pragma once

#include <memory>
#include <optional>

#include "magshell/solve/coulomb_contact.h"
#include "magshell/solve/newton.h"
#include "magshell/solve/touching_matrix.h"

namespace magshell {

struct ProjectiveOptions {
    bool on = false;
    int iterations = 0;      // at most; without a tolerance just so many
    double tolerance = 0.0;  // of the residual, as Newton's; 0: none
    int history = 0;         // pairs of secants; 0: the rounds as they are
    bool coulomb = false;    // contact is hard, with Coulomb's law: solve/coulomb_contact.h
};

class ProjectiveSolver {
  public:
    ProjectiveSolver(Newton& newton, const ProjectiveOptions& options);

    /// From q to a stationary point at the controls, or to where it failed, as Newton::solve. `scale`: of the elastic
    /// stiffness, see Model::set_history.
    NewtonReport solve(VectorXd& q, const Controls& controls, const Anchor& anchor, double scale);

  private:
    NewtonReport solve_rounds(VectorXd& q, const Controls& controls, const Anchor& anchor, double scale);
    /// Rounds with Coulomb's law in each.
    NewtonReport solve_touching(VectorXd& q, const Controls& controls, const Anchor& anchor, double scale);
    /// Whether what obstacles add has changed by much since it was `before`, which then is what it is now.
    bool touches_otherwise(const Anchor& anchor, VectorXd& before) const;
    void prepare(const VectorXd& q, const Anchor& anchor, double scale);
    VectorXd reduced_gradient(const VectorXd& q, const Anchor& anchor) const;

    Newton& newton_;
    Model& model_;
    ProjectiveOptions options_;
    ConstantMatrix matrix_;
    TouchingMatrix touching_;
    std::optional<StandingAside> aside_;  // with Coulomb's law
};

}  // namespace magshell
