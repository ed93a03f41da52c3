// NearestPoint: the place of a shape's core (shape_core.h) at which an obstacle with the distance f is nearest.
//
//   min f(x(t)) + b |t|^2/2,   x(t) = y + H t,   |t| <= 1
//
// f is convex, so there is one such place. With the slope s = H^T n + b t, it moves along directions d in which s . d = 0, within the
// segment or on the ellipsoid's surface, where s = - |s| t. The second derivatives along them are
//
//   S = d . H^T C H d + b         segment              S = d . H^T C H d + |s|         ellipsoid,   C: curvature of f
//
// A crown b > 0 makes the ends of a segment thinner by b/2, as those of bearing rollers are. Where a capsule lies along a flat or straight
// surface, its place of contact then moves continuously with the tilt.
#pragma once

#include <array>
#include <functional>

#include "magshell/obstacle/obstacle.h"
#include "magshell/terms/contact/shape_core.h"

namespace magshell {

struct NearestPoint {
    using DistanceAt = std::function<Distance(const Vec3&)>;

    Vec3 place = Vec3::Zero();          // t
    Vec3 point;                         // x(t)
    Distance at;                        // f at x(t)
    int moving = 0;                     // number of directions in which the place moves
    std::array<Vec3, 2> directions;     // d, unit vectors
    std::array<double, 2> stretches{};  // S: d . S d' = 0 between two of them
    double rise = 0.0;                  // b |t|^2/2

    NearestPoint() = default;
    /// middle, half: y and H as the core is placed in the world; its other numbers are read from `core`.
    NearestPoint(const ShapeCore& core, const Vec3& middle, const Mat3& half, const DistanceAt& distance);

  private:
    void search_segment(double crown, const Vec3& middle, const Vec3& half, const DistanceAt& distance);
    void search_ellipsoid(const Vec3& middle, const Mat3& half, const DistanceAt& distance);
    /// Sets the directions and stretches from the second derivatives along two tangents.
    void set_principal(const Eigen::Matrix2d& curvature, const Eigen::Matrix<double, 3, 2>& tangents);
};

}  // namespace magshell
