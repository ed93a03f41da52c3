// The nodes of one rigid body: computes its pose from four of them, and their positions from the pose.
//
//   x_i = c + R rho_i
//
// c is the center and R the rotation of the pose, rho_i the offset of node i from the center in the reference configuration. The first
// four nodes are the corners of a regular tetrahedron with center c, at alternate corners of a cube with edge 2 l. Their offsets satisfy
// sum rho_k rho_k^T = 4 l^2 I, so R is the rotation nearest to sum (x_k - c) rho_k^T / (4 l^2).
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

    /// nodes: first the points of the body itself, beginning with the four corners, then vertices of shells and solids that belong to the
    /// body. own: the number of the former. rest: reference positions of all nodes of the scene [m].
    RigidNodes(std::vector<Index> nodes, Index own, const std::vector<Vec3>& rest);

    const std::vector<Index>& nodes() const { return nodes_; }
    Index size() const { return static_cast<Index>(nodes_.size()); }
    Index own() const { return own_; }
    bool has_vertices() const { return size() > own_; }
    /// Returns l [m].
    double length() const { return length_; }
    /// Returns c in the reference configuration [m].
    const Vec3& middle() const { return middle_; }
    /// Returns rho of each node [m].
    const std::vector<Vec3>& offsets() const { return offsets_; }
    /// Returns rho_k / (4 l^2) of a corner [1/m]: R is nearest to the sum of x_k times this.
    Vec3 corner_weight(Index k) const { return offsets_[k] / (corners * length_ * length_); }

    /// Returns c at q [m], the mean of the four corners.
    Vec3 center(const VectorXd& q) const;
    /// Returns the pose at q, from the four corners.
    Pose pose(const VectorXd& q) const;
    /// Returns the pose that fits the vertices of shells and solids best, in the least-squares sense.
    Pose pose_of_vertices(const VectorXd& q) const;
    /// Sets the positions of all nodes in q from a pose.
    void set_positions(const Pose& pose, VectorXd& q) const;

    static constexpr Index corners = 4;  // of the tetrahedron
    // The points with mass: the corners and edge midpoints of the tetrahedron. More points of the body may lie on its surface.
    static constexpr Index points = 10;

  private:
    std::vector<Index> nodes_;
    Index own_;
    Vec3 middle_;
    std::vector<Vec3> offsets_;  // rho [m]
    double length_;
};

/// Returns the rotation nearest to a matrix that is nearly a rotation.
Mat3 orthonormal(Mat3 m);

}  // namespace magshell
