// Ellipsoid: the body (x/a)^2 + (y/b)^2 + (z/c)^2 <= 1.
//
// The nearest point of the surface is p_i = s_i^2 x_i / (t + s_i^2), with the largest root t of
//
//   F(t) = sum (s_i x_i / (t + s_i^2))^2 - 1,   s = (a, b, c)                  [Eberly, Distance from a Point to an Ellipsoid]
//
// F is convex and falls for t > - min s^2, so Newton's method rises to the root from the left end of its bracket. For points on the
// medial surface, where no such root exists, the nearest point has another coordinate along the shortest axis, of either sign.
#pragma once

#include <algorithm>
#include <cmath>

#include "magshell/obstacle/parallel_surface.h"

namespace magshell {

class Ellipsoid final : public Obstacle {
  public:
    /// semi_axes: along x, y and z [m].
    explicit Ellipsoid(const Vec3& semi_axes) : semi_axes_(semi_axes), squares_(semi_axes.cwiseAbs2()) {
        semi_axes_.minCoeff(&shortest_);
    }

    Distance distance(const Vec3& point) const override {
        const Vec3 near = nearest(point);
        const Vec3 gradient = 2.0 * near.cwiseQuotient(squares_);
        const double inside = point.cwiseQuotient(semi_axes_).squaredNorm() - 1.0;
        const double apart = std::copysign((point - near).norm(), inside);
        const Mat3 second = (2.0 * squares_.cwiseInverse()).asDiagonal();
        return parallel_surface(apart, gradient, second);
    }

  private:
    // With u = t + min s^2 every denominator is u plus a constant, exact along the shortest axis.
    Vec3 nearest(const Vec3& x) const {
        constexpr int iterations =
            60;  // Newton's method converges quadratically from the left end of any bracket
        constexpr double resolved = 1e-15;  // [-] change of u over the bracket
        const Vec3 scaled = semi_axes_.cwiseProduct(x.cwiseAbs());
        const Vec3 beyond = squares_.array() - squares_[shortest_];
        double u =
            std::max(0.0, (scaled - beyond).maxCoeff());  // one term is 1 here, so that F is not negative
        for (int k = 0; k < iterations; ++k) {
            double excess = -1.0, slope = 0.0;
            for (int axis = 0; axis < 3; ++axis) {
                if (!(scaled[axis] > 0.0)) continue;
                const double to = u + beyond[axis], term = std::pow(scaled[axis] / to, 2);
                excess += term;
                slope += 2.0 * term / to;
            }
            if (!(excess > 0.0)) break;
            u += excess / slope;
            if (!(excess > resolved * slope * scaled.norm())) break;
        }
        Vec3 near;
        double left = 1.0;
        for (int axis = 0; axis < 3; ++axis) {
            const double to = u + beyond[axis];
            near[axis] = to > 0.0 ? squares_[axis] * x[axis] / to : 0.0;
            left -= std::pow(near[axis] / semi_axes_[axis], 2);
        }
        if (!(u > 0.0))
            near[shortest_] =
                std::copysign(semi_axes_[shortest_] * std::sqrt(std::max(0.0, left)), x[shortest_]);
        return near;
    }

    Vec3 semi_axes_, squares_;
    int shortest_ = 0;
};

}  // namespace magshell
