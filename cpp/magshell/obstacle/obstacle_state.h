// An obstacle where it stands in a scene, at rest or on its way.
//
//   a point x of the world is R^T (x - c) in the obstacle's own frame,   R = R(pose) R(placement),
//   c = center + displacement; the body moves there with  v(x) = velocity + spin x (x - c)
#pragma once

#include <memory>

#include "magshell/obstacle/obstacle.h"

namespace magshell {

struct ObstaclePose {
    Vec3 displacement = Vec3::Zero(), rotation_vector = Vec3::Zero();
    Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero();  // of its center [m/s]; [rad/s], world axes
};

/// Where it was put.
struct Placement {
    Vec3 center = Vec3::Zero(), rotation_vector = Vec3::Zero();
};

/// By where it was put, and by where it has moved from there.
struct ObstacleGradient {
    Placement placement;
    ObstaclePose pose;
};

struct PositionedObstacle {
    std::shared_ptr<const Obstacle> shape;
    Placement placement;
};

/// A placed obstacle at one time. The shape has to outlive it.
class ObstacleState {
  public:
    ObstacleState(const PositionedObstacle& placed, const ObstaclePose& pose);

    /// As Obstacle::distance, at a point of the world and in its axes.
    Distance distance(const Vec3& x) const;
    /// A point of the world in the obstacle's own frame.
    Vec3 own(const Vec3& x) const { return axes_.transpose() * (x - center_); }
    /// Of the body at x [m/s].
    Vec3 velocity(const Vec3& x) const { return pose_.velocity + pose_.spin.cross(x - center_); }
    const Vec3& spin() const { return pose_.spin; }

    /// Adds the gradient by placement and pose of a function of the distance at x, its normal there and a velocity
    /// relative to the body, given the gradients by the three.
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
