// Sphere: a ball around the origin.
#pragma once

#include "magshell/obstacle/swept_ball.h"

namespace magshell {

class Sphere final : public Obstacle {
  public:
    explicit Sphere(double radius) : radius_(radius) {}

    Distance distance(const Vec3& point) const override {
        return ball_distance(point, radius_, Mat3::Identity(), Vec3::UnitZ());
    }

  private:
    double radius_;
};

}  // namespace magshell
