#include "magshell/obstacle/obstacle_state.h"

#include "magshell/core/rotation_vector.h"

namespace magshell {

ObstacleState::ObstacleState(const PositionedObstacle& placed, const ObstaclePose& pose)
    : shape_(placed.shape.get()),
      placement_(placed.placement),
      pose_(pose),
      center_(placement_.center + pose.displacement),
      moved_(rotation(pose.rotation_vector)),
      axes_(moved_ * rotation(placement_.rotation_vector)) {}

Distance ObstacleState::distance(const Vec3& x) const {
    Distance at = shape_->distance(own(x));
    at.normal = axes_ * at.normal;
    at.curvature = axes_ * at.curvature * axes_.transpose();
    return at;
}

void ObstacleState::vjp(const Vec3& x, const Distance& at, double by_distance, const Vec3& by_normal,
                        const Vec3& by_relative_velocity, ObstacleGradient& out) const {
    const Vec3 from_center = x - center_, by_place = by_distance * at.normal + at.curvature * by_normal;
    const Vec3 by_center = by_relative_velocity.cross(pose_.spin) - by_place;
    out.placement.center += by_center;
    out.pose.displacement += by_center;
    out.pose.velocity -= by_relative_velocity;
    out.pose.spin += by_relative_velocity.cross(from_center);
    // A small rotation w of the obstacle about its center changes the distance by -n . (w x (x - c)), the normal by w x n - K (w x (x - c)), with
    // K the curvature d2d/dx2. by_turn: the gradient with respect to w.
    const Vec3 by_turn = at.normal.cross(by_normal) - from_center.cross(by_place);
    out.pose.rotation_vector += transposed_jacobian_times(pose_.rotation_vector, by_turn);
    out.placement.rotation_vector +=
        transposed_jacobian_times(placement_.rotation_vector, moved_.transpose() * by_turn);
}

}  // namespace magshell
