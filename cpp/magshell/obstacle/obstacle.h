// Obstacle: the interface of rigid obstacles as signed-distance functions, as contact needs them, and two formulas of distances.
#pragma once

#include <algorithm>

#include "magshell/core/types.h"

namespace magshell {

/// The signed distance at a point, with its first and second derivatives.
struct Distance {
    double value;    // [m], negative inside the body
    Vec3 normal;     // gradient of the value, a unit vector
    Mat3 curvature;  // second derivatives of the value [1/m]
};

/// A body in a frame of its own. Its pose is given by the scene.
class Obstacle {
  public:
    virtual ~Obstacle() = default;

    /// Returns the signed distance at a point [m]. May be called from any thread. Where it has no derivatives
    /// (corners, the middle of a body), they are the limit from one side.
    virtual Distance distance(const Vec3& point) const = 0;
};

/// Fraction of the radius, or length [m] for radius zero, below which a point counts as lying on the ball's
/// center.
inline constexpr double on_the_center = 1e-12;

/// Returns the distance |offset| - radius of a point at `offset` from the nearest center of a ball.
///
/// held: projection on the directions in which that center does not follow the point. otherwise: the normal at
/// the center itself, where the curvature is infinite and returned as zero.
inline Distance ball_distance(const Vec3& offset, double radius, const Mat3& held, const Vec3& otherwise) {
    const double length = offset.norm();
    if (length <= on_the_center * (radius > 0.0 ? radius : 1.0))
        return {length - radius, otherwise, Mat3::Zero()};
    const Vec3 normal = offset / length;
    return {length - radius, normal, (held - normal * normal.transpose()) / length};
}

/// Returns the distance to a surface { f = 0 } with its derivatives, at the signed distance `value` along the
/// normal of the nearest point, given the gradient and the second derivatives of f there.
///
///   S = P (d2f) P / |df|,      P = I - n n^T,      H = S (I + d S)^-1 = (S + d K P) / (1 + d T + d^2 K)
///
/// with T and K the trace and the determinant of S in the tangent plane. The denominator is positive where the
/// point is the nearest one, and zero at a center of curvature, where H has no limit: it is bounded away from
/// zero.
inline Distance parallel_surface(double value, const Vec3& gradient, const Mat3& second) {
    constexpr double least_denominator = 1e-6;
    const double slope = gradient.norm();
    const Vec3 normal = gradient / slope;
    const Mat3 tangential = Mat3::Identity() - normal * normal.transpose();
    const Mat3 shape = tangential * second * tangential / slope;
    const double trace = shape.trace();
    const double determinant = 0.5 * (trace * trace - shape.squaredNorm());
    const double stretch = 1.0 + value * (trace + value * determinant);
    return {value, normal, (shape + value * determinant * tangential) / std::max(stretch, least_denominator)};
}

}  // namespace magshell
