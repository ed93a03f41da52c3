// Box: a box around the origin with rounded or sharp edges.
#pragma once

#include "magshell/obstacle/swept_ball.h"

namespace magshell {

/// The obstacle is a ball of the rounding radius swept through a box that is smaller by that radius on all
/// sides.
class Box final : public Obstacle {
  public:
    /// Creates the box. half_extents: of the whole box [m], each at least the rounding radius [m].
    Box(const Vec3& half_extents, double rounding)
        : core_(half_extents.array() - rounding), rounding_(rounding) {}

    Distance distance(const Vec3& point) const override {
        const Vec3 sign = point.unaryExpr([](double x) { return x < 0.0 ? -1.0 : 1.0; });
        const Vec3 beyond = point.cwiseAbs() - core_;
        const Vec3 offset = sign.cwiseProduct(beyond.cwiseMax(0.0));
        int axis;
        const double farthest = beyond.maxCoeff(&axis);
        const Vec3 face = sign[axis] * Vec3::Unit(axis);
        if (farthest <= 0.0) return {farthest - rounding_, face, Mat3::Zero()};
        const Vec3 held = beyond.unaryExpr([](double b) { return b > 0.0 ? 1.0 : 0.0; });
        return ball_distance(offset, rounding_, held.asDiagonal(), face);
    }

  private:
    Vec3 core_;  // half extents of the box that the ball is swept through
    double rounding_;
};

}  // namespace magshell
