// The nodes of one rigid body: computes its pose from four of them, and their positions from the pose.
//
//   x_i = c + R rho_i
//
// The first four nodes are the corners of a regular tetrahedron with center c; l is half the edge of the cube around it.
// With sum rho_k rho_k^T = 4 l^2 I they determine the pose.
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

    /// own: how many of the nodes, the four corners first, are no vertices of a shell or solid. rest: of all nodes of the scene [m].
    RigidNodes(std::vector<Index> nodes, Index own, const std::vector<Vec3>& rest);

    const std::vector<Index>& nodes() const { return nodes_; }
    Index size() const { return static_cast<Index>(nodes_.size()); }
    Index own() const { return own_; }
    bool has_vertices() const { return size() > own_; }
    /// Returns l [m].
    double length() const { return length_; }
    /// Returns c in the reference configuration.
    const Vec3& middle() const { return middle_; }

    Vec3 center(const VectorXd& q) const;
    Pose pose(const VectorXd& q) const;
    /// Returns the pose that fits the vertices best, in the least-squares sense.
    Pose pose_of_vertices(const VectorXd& q) const;
    void set_positions(const Pose& pose, VectorXd& q) const;

    static constexpr Index corners = 4;  // the nodes of the tetrahedron
    static constexpr Index points =
        10;  // nodes of its own that determine its start: corners and edge midpoints; more are on its surface

  private:
    std::vector<Index> nodes_;
    Index own_;
    Vec3 middle_;
    std::vector<Vec3> offsets_;  // rho [m]
    double length_;
};

/// Returns the rotation nearest to a matrix that is a rotation up to round-off.
Mat3 orthonormal(Mat3 m);

}  // namespace magshell
