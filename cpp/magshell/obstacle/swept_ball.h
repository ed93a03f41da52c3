// Balls around points, segments and curves: what sphere, capsule, box and tube have in common.
#pragma once

#include "magshell/obstacle/obstacle.h"

namespace magshell {

/// Below this fraction of the radius, or this length [m], a point counts as lying on the ball's center.
inline constexpr double on_the_center = 1e-12;

/// The distance |offset| - radius of a point at `offset` from the nearest center of a ball.
///
/// `held` is the projection on the directions in which that center does not follow the point, and `otherwise`
/// the normal on the center itself, where there is no curvature to speak of: it is infinite.
inline Distance ball_distance(const Vec3& offset, double radius, const Mat3& held, const Vec3& otherwise) {
    const double length = offset.norm();
    if (length <= on_the_center * (radius > 0.0 ? radius : 1.0))
        return {length - radius, otherwise, Mat3::Zero()};
    const Vec3 normal = offset / length;
    return {length - radius, normal, (held - normal * normal.transpose()) / length};
}

}  // namespace magshell
