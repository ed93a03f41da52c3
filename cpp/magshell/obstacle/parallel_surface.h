// Curvature of the parallel surfaces of a smooth surface.
#pragma once

#include <algorithm>

#include "magshell/obstacle/obstacle.h"

namespace magshell {

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
