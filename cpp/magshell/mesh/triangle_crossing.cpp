#include "magshell/mesh/triangle_crossing.h"

#include <algorithm>

namespace magshell {
namespace {

/// The range of distances of points along a direction.
struct Range {
    double low, high;

    bool beyond(double close) const { return low > close || high < -close; }
};

Range range_of(const Triangle& t, const Vec3& origin, const Vec3& direction) {
    const double d[3] = {direction.dot(t.corner[0] - origin), direction.dot(t.corner[1] - origin),
                         direction.dot(t.corner[2] - origin)};
    return {std::min({d[0], d[1], d[2]}), std::max({d[0], d[1], d[2]})};
}

/// Returns true if the plane of a, or a plane through one of its edges and its normal, has all of b on the
/// other side.
bool separated_by(const Triangle& a, const Triangle& b, double close) {
    if (range_of(b, a.corner[0], a.normal).beyond(close)) return true;
    for (int i = 0; i < 3; ++i) {
        const Vec3 outward = (a.corner[(i + 1) % 3] - a.corner[i]).cross(a.normal).normalized();
        if (range_of(b, a.corner[i], outward).low > close) return true;
    }
    return false;
}

/// Tests an edge from p to q against the interior of a triangle: it crosses if its ends lie on both sides of
/// the plane and it passes all three sides in the same sense.
Meeting meeting(const Vec3& p, const Vec3& q, const Triangle& t, double close) {
    const double at_p = t.normal.dot(p - t.corner[0]), at_q = t.normal.dot(q - t.corner[0]);
    if (std::min(at_p, at_q) > close || std::max(at_p, at_q) < -close) return Meeting::apart;
    const Vec3 along = (q - p).normalized();
    bool one_side = false, other_side = false;
    bool certain = std::min(at_p, at_q) < -close && std::max(at_p, at_q) > close;
    for (int i = 0; i < 3; ++i) {
        const Vec3& from = t.corner[i];
        const double distance = along.cross((t.corner[(i + 1) % 3] - from).normalized()).dot(from - p);
        if (distance > close)
            one_side = true;
        else if (distance < -close)
            other_side = true;
        else
            certain = false;
    }
    if (one_side && other_side) return Meeting::apart;
    return certain ? Meeting::crossing : Meeting::touching;
}

}  // namespace

// If two triangles cross, the ends of their common line lie on edges of one or the other.
Meeting meeting(const Triangle& a, const Triangle& b, double close) {
    if (separated_by(a, b, close) || separated_by(b, a, close)) return Meeting::apart;
    Meeting most = Meeting::apart;
    for (int i = 0; i < 3; ++i) {
        most = std::max(most, meeting(a.corner[i], a.corner[(i + 1) % 3], b, close));
        most = std::max(most, meeting(b.corner[i], b.corner[(i + 1) % 3], a, close));
    }
    return most;
}

// The common line of two triangles with one common vertex begins at the vertex and ends on the edge opposite to
// it, of one or the other.
Meeting meeting_beyond_vertex(const Triangle& a, int i, const Triangle& b, int j, double close) {
    const Vec3& vertex = a.corner[i];
    const Vec3 &a1 = a.corner[(i + 1) % 3], &a2 = a.corner[(i + 2) % 3];
    const Vec3 &b1 = b.corner[(j + 1) % 3], &b2 = b.corner[(j + 2) % 3];
    // In smooth surfaces nearly all such pairs extend in different directions, which this test detects.
    const Vec3 to_a = (a1 - vertex).normalized() + (a2 - vertex).normalized(),
               to_b = (b1 - vertex).normalized() + (b2 - vertex).normalized();
    const Vec3 between = (to_a - to_b).normalized();
    if (std::min(between.dot(a1 - vertex), between.dot(a2 - vertex)) > close &&
        std::max(between.dot(b1 - vertex), between.dot(b2 - vertex)) < -close)
        return Meeting::apart;
    return std::max(meeting(a1, a2, b, close), meeting(b1, b2, a, close));
}

}  // namespace magshell
