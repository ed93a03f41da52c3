// Nodes that move as one rigid body.
//
//   x_i = c + R rho_i,   c -> c + u,  R -> exp([w]) R,   z = (u, l w)
//   dx_i = u + w x r_i,  r_i = x_i - c;   d2x_i = 1/2 (w_1 x (w_2 x r_i) + w_2 x (w_1 x r_i))
//
// The first four nodes are the corners of a regular tetrahedron of its own, c their mean, l the half edge of the cube
// around them: they tell the pose. Nodes are always rebuilt from it, so that no rounding adds up.
#pragma once

#include "magshell/assembly/carrier.h"

namespace magshell {

class RigidCarrier final : public Carrier {
  public:
    /// `own`: how many of the nodes, the four corners first, are no vertices of a body. rest: of all nodes of the scene.
    RigidCarrier(std::vector<Index> nodes, Index own, const std::vector<Vec3>& rest);

    Index coordinates() const override { return 6; }
    Eigen::MatrixXd jacobian(const VectorXd& q) const override;
    Eigen::MatrixXd curvature(const VectorXd& q, const VectorXd& gradient) const override;
    void advance(VectorXd& q, const VectorXd& z) const override;
    void settle(VectorXd& q, VectorXd* v) const override;
    void settle_vjp(const VectorXd& q, const VectorXd& v, VectorXd& by_q, VectorXd& by_v) const override;

    static constexpr Index corners = 4;

  private:
    struct Pose {
        Vec3 center;
        Mat3 rotation;
    };
    Vec3 center(const VectorXd& q) const;
    Pose pose(const VectorXd& q) const;
    Pose pose_of_vertices(const VectorXd& q) const;
    void place(const Pose& pose, VectorXd& q) const;
    /// Rows of B of its vertices, or of all its nodes where it has none.
    Eigen::MatrixXd leading(const Eigen::MatrixXd& jacobian) const { return jacobian.bottomRows(leading_); }

    Index own_, leading_;
    std::vector<Vec3> offsets_;  // rho
    double length_;
};

}  // namespace magshell
