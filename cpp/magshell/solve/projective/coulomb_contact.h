// Hard contact with Coulomb friction, against obstacles and between bodies, for Projective Dynamics.   [Qiao21] 5, [Ly et al. 2020]
//
// One iteration of Projective Dynamics moves the nodes by d = d0 + A^-1 f, with contact forces f [N] on the nodes. A^-1 is the same
// along x, y and z, so it couples two nodes by one number W_ij. The relative position of a contact is a weighted sum of nodes,
// x = sum_i w_i x_i: a node against an obstacle, or the difference of the closest points of two bodies. For one contact alone
// Coulomb's law has a closed-form solution:
//
//   gap = g + n . x,  slip = x - x_begin - dt v_obstacle,  x = y + W f,  W = sum_ij w_i w_j W_ij   (y: position without its force f)
//   gap >= 0, f_n >= 0, gap f_n = 0;  |f_t| <= mu f_n, and if it slips f_t = - mu f_n slip/|slip|
//
// Node i receives w_i f, so the forces between two bodies sum to zero. Bodies are kept apart by the sum of the activation distance and the
// minimum separation of their contact, as with infinite stiffness.
//
// [Qiao21] (21) uses (M + dt^2 D)^-1 in place of W and leaves the coupling between nodes to the outer iterations. These then
// number hundreds, since each one transmits a force only to the neighbours of a node. Here Gauss-Seidel sweeps over the active contacts
// (Moreau; Jean) use all W_ij, because A is factorized anyway. Both converge to the same forces.
#pragma once

#include <map>
#include <vector>

#include "magshell/solve/newton/newton.h"
#include "magshell/solve/projective/constant_matrix.h"
#include "magshell/terms/contact/contacts.h"

namespace magshell {

/// RAII guard that switches off the smooth contact laws of all contacts while it exists.
class ScopedContactOff {
  public:
    explicit ScopedContactOff(const Model& model);
    ScopedContactOff(const ScopedContactOff&) = delete;
    ScopedContactOff& operator=(const ScopedContactOff&) = delete;
    ~ScopedContactOff() { stand(false); }

  private:
    void stand(bool aside) const;

    const Model& model_;
};

class CoulombContact {
  public:
    /// Starts a stage whose step began at `begin` [m], `time` [s] ago. Throws InvalidInput if points on faces may come into
    /// contact, or if a contact has different static and kinetic coefficients of friction.
    CoulombContact(const Model& model, const ConstantMatrix& matrix, const LoadParameters& load_parameters,
                   const VectorXd& begin, double time);

    /// Returns the current contact forces, of all dofs [N].
    const VectorXd& forces() const { return forces_; }

    /// Updates gaps and normals at q. Returns the largest violation of the law, as the distance by which a pair
    /// would have to move [m].
    double assess(const VectorXd& q);
    /// Solves for the contact forces at q, assessed last, and updates the displacement `move` from q that they cause.
    void solve_forces(const VectorXd& q, VectorXd& move);

  private:
    struct Pair {
        std::array<Index, 4> nodes;
        int count;
        PairWeights weights;
        double friction;
        double gap = 0.0;  // [m], at q
        Vec3 normal = Vec3::Zero(), force = Vec3::Zero();
        Vec3 prescribed = Vec3::Zero();  // [m], displacement of the other side by its own motion

        /// Returns the relative position or displacement of the pair, from a vector of all dofs.
        Vec3 of(const VectorXd& all) const {
            Vec3 sum = Vec3::Zero();
            for (int i = 0; i < count; ++i) sum += weights[i] * all.segment<3>(3 * nodes[i]);
            return sum;
        }
    };
    struct OnObstacle {
        ContactTerm::HardContact keeping;
        ObstacleState obstacle;
    };

    /// Returns the force of Coulomb's law on a pair. ahead: its displacement since it was assessed, without: its position with no
    /// force on it, own: its compliance W [m/N].
    Vec3 contact_force(const Pair& pair, const Vec3& ahead, const Vec3& without, double own) const;
    void update_obstacle_pairs(const VectorXd& q);
    void update_body_pairs(const VectorXd& q);
    /// Returns c^T A^-1 c between some pairs, the same along x, y and z [m/N].
    Eigen::MatrixXd compliance(const std::vector<std::size_t>& of) const;
    /// Applies the forces of the pairs to the nodes and updates the displacement accordingly.
    void apply_forces(VectorXd& move);

    const Model& model_;
    const ConstantMatrix& matrix_;
    const VectorXd& begin_;
    double time_, negligible_;
    std::vector<OnObstacle> obstacles_;
    std::vector<Pair> pairs_;  // pairs with obstacles in their order, then pairs of bodies
    std::vector<BodyContactTerm::HardContactPair> between_;
    VectorXd forces_;
};

}  // namespace magshell
