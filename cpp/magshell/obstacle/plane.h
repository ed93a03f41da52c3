// A half-space.
#pragma once

#include "magshell/obstacle/obstacle.h"

namespace magshell {

/// All points x with normal . x <= 0.
class Plane final : public Obstacle {
  public:
    /// Any normal but zero.
    explicit Plane(const Vec3& normal) : normal_(normal.normalized()) {}

    Distance distance(const Vec3& point) const override {
        return {normal_.dot(point), normal_, Mat3::Zero()};
    }

  private:
    Vec3 normal_;
};

}  // namespace magshell
