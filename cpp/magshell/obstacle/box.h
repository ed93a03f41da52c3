// A box around the origin, its edges and corners rounded or sharp.
#pragma once

#include "magshell/obstacle/swept_ball.h"

namespace magshell {

/// A box that is smaller by the rounding on all sides, with a ball of that radius swept through it.
class Box final : public Obstacle {
  public:
    /// half_extents: of the whole, each at least the rounding.
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
