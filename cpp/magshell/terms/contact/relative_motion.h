// RelativeMotion: the motion of a rigid body that carries an obstacle, as contact at a point of another body needs it.
//
//   c = sum x_k / 4,   R = sum x_k w_k^T,   w_k = rho_k / 4 l^2          corners k = 0..3 of the rigid body (rigid_nodes.h)
//   y = R^T (x - c)                                                      the point x in the axes of the rigid body
//   R dy = dx + sum G_k dx_k,   G_k = - I/4 + (R w_k) (x - c)^T          velocity of the point relative to the rigid body
//
// A force f on the point has the reaction sum G_k^T f on the corners. Its resultant is -f, and its moment that of -f at the point: the sum
// of w_k is zero, and sum (x_k - c) w_k^T = R. So contact keeps the momentum and the angular momentum of both to round-off.
#pragma once

#include <array>
#include <vector>

#include "magshell/core/types.h"
#include "magshell/obstacle/obstacle.h"

namespace magshell {

/// The corners of a rigid body that carries obstacles.
class CornerFrame {
  public:
    using Corners = std::array<Index, 4>;
    struct Pose {
        Vec3 center;  // c
        Mat3 axes;    // R
    };

    /// rest: reference positions of all nodes [m].
    CornerFrame(const Corners& corners, const std::vector<Vec3>& rest) : corners_(corners) {
        for (const Index corner : corners) rest_center_ += 0.25 * rest[corner];
        for (int k = 0; k < 4; ++k) {
            const Vec3 rho = rest[corners[k]] - rest_center_;
            weights_[k] = rho * (3.0 / (4.0 * rho.squaredNorm()));  // |rho|^2 = 3 l^2
        }
    }

    const Corners& corners() const { return corners_; }
    /// Returns c in the reference configuration [m].
    const Vec3& rest_center() const { return rest_center_; }
    /// Returns w_k [1/m].
    const Vec3& weight(int k) const { return weights_[k]; }
    Pose pose(const double* q) const {
        Pose at{Vec3::Zero(), Mat3::Zero()};
        for (const Index corner : corners_) at.center += 0.25 * node(q, corner);
        for (int k = 0; k < 4; ++k) at.axes += (node(q, corners_[k]) - at.center) * weights_[k].transpose();
        return at;
    }
    /// Returns where a point of the world was in the reference configuration, if it rode on the rigid body.
    Vec3 at_rest(const Pose& pose, const Vec3& x) const {
        return rest_center_ + pose.axes.transpose() * (x - pose.center);
    }

  private:
    static Eigen::Map<const Vec3> node(const double* q, Index k) { return Eigen::Map<const Vec3>(q + 3 * k); }

    Corners corners_;
    Vec3 rest_center_ = Vec3::Zero();
    std::array<Vec3, 4> weights_;
};

/// A point in contact with an attached obstacle, at one state.
struct RelativeMotion {
    const CornerFrame* frame;
    Mat3 axes;                   // R
    Vec3 arm;                    // x - c
    std::array<Vec3, 4> levers;  // R w_k

    RelativeMotion(const CornerFrame& by, const CornerFrame::Pose& pose, const Vec3& x)
        : frame(&by), axes(pose.axes), arm(x - pose.center) {
        for (int k = 0; k < 4; ++k) levers[k] = axes * by.weight(k);
    }
    /// Returns where the point was in the reference configuration, if it rode on the rigid body.
    Vec3 at_rest() const { return frame->rest_center() + axes.transpose() * arm; }
    Index corner(int k) const { return frame->corners()[k]; }
    /// Returns G_k.
    Mat3 jacobian(int k) const { return levers[k] * arm.transpose() - 0.25 * Mat3::Identity(); }
    /// Returns sum G_k p_k, for a vector of all degrees of freedom.
    Vec3 motion(const double* all) const {
        Vec3 sum = Vec3::Zero();
        for (int k = 0; k < 4; ++k) {
            const Eigen::Map<const Vec3> at(all + 3 * corner(k));
            sum += levers[k] * arm.dot(at) - 0.25 * at;
        }
        return sum;
    }
    /// Returns G_k^T f.
    Vec3 reaction(int k, const Vec3& force) const { return arm * levers[k].dot(force) - 0.25 * force; }
    /// Returns a distance in the world's axes, given it in those of the rigid body; and back.
    Distance in_world(const Distance& at) const {
        return {at.value, axes * at.normal, axes * at.curvature * axes.transpose()};
    }
    Distance in_body(const Distance& at) const {
        return {at.value, axes.transpose() * at.normal, axes.transpose() * at.curvature * axes};
    }
};

}  // namespace magshell
