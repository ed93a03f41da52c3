// Whether two triangles in space pass through each other, or only touch.
#pragma once

#include "magshell/core/types.h"

namespace magshell {

/// crossing: an edge of one goes through the inside of the other, with both ends and all sides farther than
/// the tolerance. touching: too close to say. apart: neither.
enum class Meeting { apart, touching, crossing };

/// A triangle where it is now.
struct Triangle {
    Vec3 corner[3];
    Vec3 normal;  // of length one; zero where the corners are on one line

    Triangle(const Vec3& a, const Vec3& b, const Vec3& c)
        : corner{a, b, c}, normal((b - a).cross(c - a).normalized()) {}
};

/// Of two triangles without a common vertex. close: [m], a tolerance that is above the error of coordinates.
Meeting meeting(const Triangle& a, const Triangle& b, double close);

/// Of two triangles whose corners i and j are one vertex, beyond it.
Meeting meeting_beyond_vertex(const Triangle& a, int i, const Triangle& b, int j, double close);

}  // namespace magshell
