// ObstacleState: an obstacle with its position and motion in a scene at one time.
//
//   a point x of the world is R^T (x - c) in the obstacle's own frame,   R = R(pose) R(placement),
//   c = center + displacement; the velocity of the body there is  v(x) = velocity + spin x (x - c)
#pragma once

#include <memory>

#include "magshell/obstacle/obstacle.h"

namespace magshell {

struct ObstaclePose {
    Vec3 displacement = Vec3::Zero(), rotation_vector = Vec3::Zero();
    // of the center [m/s]; angular velocity [rad/s], world axes
    Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero();
};

/// The initial placement: center [m] and rotation vector [rad].
struct Placement {
    Vec3 center = Vec3::Zero(), rotation_vector = Vec3::Zero();
};

/// The gradient with respect to the placement and to the pose relative to it.
struct ObstacleGradient {
    Placement placement;
    ObstaclePose pose;
};

struct PositionedObstacle {
    std::shared_ptr<const Obstacle> shape;
    Placement placement;
};

/// An obstacle at one time. The shape must outlive it.
class ObstacleState {
  public:
    ObstacleState(const PositionedObstacle& placed, const ObstaclePose& pose);

    /// Returns the signed distance as Obstacle::distance does, at a point of the world and in world axes.
    Distance distance(const Vec3& x) const;
    /// Returns a point of the world in the obstacle's own frame.
    Vec3 own(const Vec3& x) const { return axes_.transpose() * (x - center_); }
    /// Returns the velocity of the body at x [m/s].
    Vec3 velocity(const Vec3& x) const { return pose_.velocity + pose_.spin.cross(x - center_); }
    const Vec3& spin() const { return pose_.spin; }

    /// Adds the gradient with respect to placement and pose of a function of the distance at x, its normal and the velocity
    /// relative to the body, given its gradients with respect to these three.
    void vjp(const Vec3& x, const Distance& at, double by_distance, const Vec3& by_normal,
             const Vec3& by_relative_velocity, ObstacleGradient& out) const;

  private:
    const Obstacle* shape_;
    Placement placement_;
    ObstaclePose pose_;
    Vec3 center_;
    Mat3 moved_, axes_;  // R(pose), R
};

}  // namespace magshell
