// Obstacles with signed distances in closed form: half-space, ball, capsule, box and ellipsoid, and the space around a body.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "magshell/obstacle/obstacle.h"

namespace magshell {

/// A half-space: the body consists of all points x with normal . x <= 0.
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

/// A ball around the origin.
class Sphere final : public Obstacle {
  public:
    explicit Sphere(double radius) : radius_(radius) {}

    Distance distance(const Vec3& point) const override {
        return ball_distance(point, radius_, Mat3::Identity(), Vec3::UnitZ());
    }

  private:
    double radius_;
};

/// A ball swept along a segment.
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

/// A box around the origin with rounded or sharp edges: a ball of the rounding radius swept through a box that is smaller by that radius on all
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

/// The space around a body, as an obstacle, which keeps other bodies inside that body.
class Complement final : public Obstacle {
  public:
    explicit Complement(std::shared_ptr<const Obstacle> body) : body_(std::move(body)) {}

    Distance distance(const Vec3& point) const override {
        const Distance d = body_->distance(point);
        return {-d.value, -d.normal, -d.curvature};
    }

  private:
    std::shared_ptr<const Obstacle> body_;
};

/// The body (x/a)^2 + (y/b)^2 + (z/c)^2 <= 1.
///
/// The nearest point of the surface is p_i = s_i^2 x_i / (t + s_i^2), with the largest root t of
///
///   F(t) = sum (s_i x_i / (t + s_i^2))^2 - 1,   s = (a, b, c)                  [Eberly, Distance from a Point to an Ellipsoid]
///
/// F is convex and falls for t > - min s^2, so Newton's method rises to the root from the left end of its bracket. For points on the
/// medial surface, where no such root exists, the nearest point has another coordinate along the shortest axis, of either sign.
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
