// Tests whether two triangles in space pass through each other, or only touch.
#pragma once

#include "magshell/core/types.h"

namespace magshell {

/// crossing: an edge of one passes through the interior of the other, with both ends and all sides farther away
/// than the tolerance. touching: too close to decide. apart: neither.
enum class Meeting { apart, touching, crossing };

/// A triangle at its current position.
struct Triangle {
    Vec3 corner[3];
    Vec3 normal;  // unit normal; zero where the corners are on one line

    Triangle(const Vec3& a, const Vec3& b, const Vec3& c)
        : corner{a, b, c}, normal((b - a).cross(c - a).normalized()) {}
};

/// Tests two triangles without a common vertex. close: tolerance [m], larger than the error of coordinates.
Meeting meeting(const Triangle& a, const Triangle& b, double close);

/// Tests two triangles whose corners i and j are the same vertex, beyond that vertex.
Meeting meeting_beyond_vertex(const Triangle& a, int i, const Triangle& b, int j, double close);

}  // namespace magshell
