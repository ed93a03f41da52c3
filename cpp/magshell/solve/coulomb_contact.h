// Hard contact under Coulomb's law, with obstacles and between bodies, for Projective Dynamics.    [Qiao21] 5, [Ly et al. 2020]
//
// A round of Projective Dynamics moves the nodes by d = d0 + A^-1 f with forces f [N] on the nodes that touch. A is the same
// along x, y and z, so that its inverse between nodes is one number W_ij, and where a sum of places x = sum_i w_i x_i touches
// (a node and an obstacle; the difference of the closest points of two bodies) the law has a closed answer:
//
//   gap = g + n . x,  slip = x - x_begin - dt v_obstacle,  x = y + W f,  W = sum_ij w_i w_j W_ij   (y: without its own f)
//   gap >= 0, f_n >= 0, gap f_n = 0;  |f_t| <= mu f_n, and where it slips f_t = - mu f_n slip/|slip|
//
// Node i gets w_i f: what bodies do to each other sums to zero. They keep what a contact's reach and minimal distance are
// together, as they do with a stiffness without end.
//
// [Qiao21] (21) has (M + dt^2 D)^-1 in the place of W and leaves everything between nodes to its rounds, of which it then
// takes hundreds, as they carry a push from a node to its neighbours only. Here sweeps over what touches (Gauss and
// Seidel's; Moreau, Jean) use all W_ij: A is factorized anyway. Both end at the same forces.
#pragma once

#include <map>
#include <vector>

#include "magshell/solve/constant_matrix.h"
#include "magshell/solve/newton.h"
#include "magshell/term/body_contact_term.h"
#include "magshell/term/contact_term.h"

namespace magshell {

/// The smooth laws of all contacts are off while it lives.
class StandingAside {
  public:
    explicit StandingAside(const Model& model);
    StandingAside(const StandingAside&) = delete;
    StandingAside& operator=(const StandingAside&) = delete;
    ~StandingAside() { stand(false); }

  private:
    void stand(bool aside) const;

    const Model& model_;
};

class CoulombContact {
  public:
    /// At a stage that began at `begin` [m] so long ago [s]. Throws InvalidInput where points on faces touch, or where what
    /// sticks has another coefficient than what slides.
    CoulombContact(const Model& model, const ConstantMatrix& matrix, const Controls& controls,
                   const VectorXd& begin, double time);

    /// Forces on all unknowns so far [N].
    const VectorXd& forces() const { return forces_; }

    /// Looks where q is. How far [m] the law would have a pair from there, given its force.
    double look(const VectorXd& q);
    /// Changes the forces, and with them a move of all unknowns from q, looked at last, until they fit each other there.
    void settle(const VectorXd& q, VectorXd& move);

  private:
    struct Pair {
        std::array<Index, 4> nodes;
        int count;
        PairWeights weights;
        double friction;
        double gap = 0.0;  // [m] at q
        Vec3 normal = Vec3::Zero(), force = Vec3::Zero();
        Vec3 carried = Vec3::Zero();  // [m] what the other side goes by itself

        /// The weighted sum of what nodes have in a vector of all unknowns.
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

    /// The force on a pair that would be at `without`, `ahead` of where it was looked at, if it had none.
    Vec3 answer(const Pair& pair, const Vec3& ahead, const Vec3& without, double own) const;
    void look_at_obstacles(const VectorXd& q);
    void look_at_bodies(const VectorXd& q);
    /// c^T A^-1 c between some of the pairs, the same along x, y and z [m/N].
    Eigen::MatrixXd compliance(const std::vector<std::size_t>& of) const;
    /// Has the forces on the nodes be those of the pairs, and the move follow.
    void push(VectorXd& move);

    const Model& model_;
    const ConstantMatrix& matrix_;
    const VectorXd& begin_;
    double time_, negligible_;
    std::vector<OnObstacle> obstacles_;
    std::vector<Pair> pairs_;  // of obstacles, in their order, then of bodies
    std::vector<BodyContactTerm::HardContactPair> between_;
    VectorXd forces_;
};

}  // namespace magshell
