#include "magshell/obstacle/passage.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace magshell {
namespace {

// [-] Cosine between normals on opposite sides of a body; an edge of a box has no opposite sides.
constexpr double opposite = -1e-6;
// Parts of a motion in which the triangle is looked for on both sides of the point; see test_obstacles_that_move_far.py.
constexpr int parts = 8;
constexpr int bisections = 50;
constexpr double on_edge =
    -1e-9;  // [-] barycentric coordinate of a point on an edge, which belongs to both faces

std::array<Vec3, 3> between(const std::array<Vec3, 3>& from, const std::array<Vec3, 3>& to, const Vec3& point,
                            double t) {
    std::array<Vec3, 3> at;
    for (int k = 0; k < 3; ++k) at[k] = (1.0 - t) * from[k] + t * to[k] - point;
    return at;
}

double volume(const std::array<Vec3, 3>& corners) {
    return corners[0].dot(corners[1].cross(corners[2]));
}

// Whether the origin, which is in the plane of a triangle, is within it.
bool holds_origin(const std::array<Vec3, 3>& x) {
    const Vec3 normal = (x[1] - x[0]).cross(x[2] - x[0]);
    const double squared = normal.squaredNorm();
    if (!(squared > 0.0)) return false;
    for (int k = 0; k < 3; ++k)
        if (!(normal.dot(x[(k + 1) % 3].cross(x[(k + 2) % 3])) >= on_edge * squared)) return false;
    return true;
}

// Finds where the straight way from a point to another, `length` long, enters a body that is thicker by a radius: steps of the
// distance's own length cannot miss a surface. False where it stays outside.
bool enters(const Obstacle& shape, const Vec3& from, const Vec3& to, double length, double radius,
            Distance& at) {
    constexpr double least_advance = 1e-3;  // [-] of the way, where it runs along the surface
    const auto distance = [&](const Vec3& x) {
        Distance found = shape.distance(x);
        found.value -= radius;
        return found;
    };
    at = distance(from);
    if (!(at.value > 0.0)) return true;
    if (length <= at.value) return false;
    double travelled = at.value / length;
    while (at.value > 0.0) {
        if (travelled >= 1.0) return false;
        at = distance(from + travelled * (to - from));
        travelled += std::max(at.value / length, least_advance);
    }
    return true;
}

}  // namespace

// The sides are those where the way enters, where it leaves and where it ends: the ends tell of a thin body, the exit of one that is
// hollow.
bool passes_through(const Obstacle& shape, const Vec3& from, const Vec3& to, double radius) {
    const double length = (to - from).norm();
    Distance in, out;
    if (!enters(shape, from, to, length, radius, in)) return false;
    if (in.normal.dot(shape.distance(to).normal) < opposite) return true;
    return enters(shape, to, from, length, radius, out) && in.normal.dot(out.normal) < opposite;
}

bool sweeps_over(const std::array<Vec3, 3>& from, const std::array<Vec3, 3>& to, const Vec3& point) {
    for (int axis = 0; axis < 3; ++axis) {
        const auto [low, high] =
            std::minmax({from[0][axis], from[1][axis], from[2][axis], to[0][axis], to[1][axis], to[2][axis]});
        if (point[axis] < low || point[axis] > high) return false;
    }
    double before = volume(between(from, to, point, 0.0));
    for (int part = 0; part < parts; ++part) {
        double low = double(part) / parts, high = double(part + 1) / parts;
        const double after = volume(between(from, to, point, high));
        if ((before < 0.0) != (after < 0.0)) {
            for (int k = 0; k < bisections; ++k) {
                const double middle = 0.5 * (low + high);
                ((volume(between(from, to, point, middle)) < 0.0) == (before < 0.0) ? low : high) = middle;
            }
            if (holds_origin(between(from, to, point, low))) return true;
        }
        before = after;
    }
    return false;
}

}  // namespace magshell
