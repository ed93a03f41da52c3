// Capsule: a ball swept along a segment.
#pragma once

#include <algorithm>

#include "magshell/obstacle/swept_ball.h"

namespace magshell {

class Capsule final : public Obstacle {
  public:
    /// Creates the capsule; the ends of the segment must differ.
    Capsule(const Vec3& start, const Vec3& end, double radius)
        : start_(start), length_((end - start).norm()), along_((end - start) / length_), radius_(radius) {}

    Distance distance(const Vec3& point) const override {
        const Vec3 offset = point - start_;
        const double place = along_.dot(offset);
        const double nearest = std::clamp(place, 0.0, length_);
        Mat3 held = Mat3::Identity();
        if (place == nearest) held -= along_ * along_.transpose();
        return ball_distance(offset - nearest * along_, radius_, held, along_.unitOrthogonal());
    }

  private:
    Vec3 start_;
    double length_;
    Vec3 along_;
    double radius_;
};

}  // namespace magshell
