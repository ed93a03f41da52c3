// Distance to a ball swept along points, segments or curves, as sphere, capsule, box and tube share it.
#pragma once

#include "magshell/obstacle/obstacle.h"

namespace magshell {

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

}  // namespace magshell
