// Plane: a half-space as an obstacle.
#pragma once

#include "magshell/obstacle/obstacle.h"

namespace magshell {

/// The body consists of all points x with normal . x <= 0.
class Plane final : public Obstacle {
  public:
    /// Creates the half-space; the normal must not be zero and need not be a unit vector.
    explicit Plane(const Vec3& normal) : normal_(normal.normalized()) {}

    Distance distance(const Vec3& point) const override {
        return {normal_.dot(point), normal_, Mat3::Zero()};
    }

  private:
    Vec3 normal_;
};

}  // namespace magshell
