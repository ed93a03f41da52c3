// Nodes of one rigid body: where it is, from four of them, and where they are, from that.
//
//   x_i = c + R rho_i
//
// The first four are the corners of a regular tetrahedron of its own, c their mean, l the half edge of the cube around
// them: with sum rho_k rho_k^T = 4 l^2 I they tell the pose.
#pragma once

#include <vector>

#include "magshell/core/types.h"

namespace magshell {

class RigidNodes {
  public:
    struct Pose {
        Vec3 center;
        Mat3 rotation;
    };

    /// `own`: how many of the nodes, the four corners first, are no vertices of a body. rest: of all nodes of the scene.
    RigidNodes(std::vector<Index> nodes, Index own, const std::vector<Vec3>& rest);

    const std::vector<Index>& nodes() const { return nodes_; }
    Index size() const { return static_cast<Index>(nodes_.size()); }
    Index own() const { return own_; }
    bool has_vertices() const { return size() > own_; }
    /// l [m]
    double length() const { return length_; }
    /// c at rest.
    const Vec3& middle() const { return middle_; }

    Vec3 center(const VectorXd& q) const;
    Pose pose(const VectorXd& q) const;
    /// The one that fits the vertices best.
    Pose pose_of_vertices(const VectorXd& q) const;
    void place(const Pose& pose, VectorXd& q) const;

    static constexpr Index corners = 4;
    static constexpr Index points = 10;  // of its own, that tell where it starts; more are on its surface

  private:
    std::vector<Index> nodes_;
    Index own_;
    Vec3 middle_;
    std::vector<Vec3> offsets_;  // rho
    double length_;
};

/// The rotation next to a matrix that is one but for rounding.
Mat3 orthonormal(Mat3 m);

}  // namespace magshell
