// Hard contact with obstacles under Coulomb's law, node by node, for Projective Dynamics.          [Qiao21] 5, [Ly et al. 2020]
//
// A round of Projective Dynamics moves the nodes by d = d0 + A^-1 f with forces f [N] on the nodes that touch. A is the same
// along x, y and z, so that its inverse between nodes is one number W_ij, and at each node the law has a closed answer:
//
//   gap = g + n . x,  slip = x - x_begin - dt v_obstacle,  x = y + W_ii f     (y: where the node is without its own f)
//   gap >= 0, f_n >= 0, gap f_n = 0;  |f_t| <= mu f_n, and where it slips f_t = - mu f_n slip/|slip|
//
// [Qiao21] (21) has (M + dt^2 D)^-1 in the place of W_ii and leaves everything between nodes to its rounds, of which it then
// takes hundreds, as they carry a push from a node to its neighbours only. Here sweeps over the nodes that touch (Gauss and
// Seidel's; Moreau, Jean) use all W_ij: A is factorized anyway. Both end at the same forces.
#pragma once

#include <map>
#include <vector>

#include "magshell/solve/constant_matrix.h"
#include "magshell/solve/newton.h"
#include "magshell/term/contact_term.h"

namespace magshell {

class CoulombContact {
  public:
    /// At a stage that began at `begin` [m] so long ago [s]. Throws InvalidInput where points on faces touch.
    CoulombContact(const Model& model, const ConstantMatrix& matrix, const Controls& controls,
                   const VectorXd& begin, double time);

    /// Forces on all unknowns so far [N].
    const VectorXd& forces() const { return forces_; }

    /// Looks where q is. How far [m] the law would have a node from there, given its force.
    double look(const VectorXd& q);
    /// Changes the forces, and with them a move of all unknowns from q, looked at last, until they fit each other there.
    void settle(const VectorXd& q, VectorXd& move);

  private:
    struct Pair {
        ContactTerm::Keeping keeping;
        StandingObstacle obstacle;
        double gap = 0.0;  // [m] at q
        Vec3 normal = Vec3::Zero(), force = Vec3::Zero(), obstacle_move = Vec3::Zero();
    };

    Vec3 answer(const Pair& pair, const Vec3& from, const Vec3& without, double inverse) const;

    const ConstantMatrix& matrix_;
    const VectorXd& begin_;
    double time_, negligible_;
    std::vector<Pair> pairs_;
    VectorXd forces_;
};

}  // namespace magshell
