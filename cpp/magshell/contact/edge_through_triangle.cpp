#include "magshell/contact/edge_through_triangle.h"

#include <algorithm>
#include <limits>

#include "magshell/contact/proximity.h"

namespace magshell {
namespace {

// [-] Relative round-off of a signed volume; fixed by test_crossings_are_those_of_ipctk
constexpr double round_off = 16.0 * std::numeric_limits<double>::epsilon();

/// Returns the side of the plane through a, b, c on which a point is: 1, -1, or 0 if round-off leaves it open.
int side(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& point) {
    const Vec3 one = a - point, two = b - point, three = c - point;
    const double volume = one.dot(two.cross(three));
    const double bound =
        round_off *
        one.cwiseAbs().dot(Vec3(two.y() * three.z(), two.z() * three.x(), two.x() * three.y()).cwiseAbs() +
                           Vec3(two.z() * three.y(), two.x() * three.z(), two.y() * three.x()).cwiseAbs());
    return volume > bound ? 1 : volume < -bound ? -1 : 0;
}

}  // namespace

bool passes_through(const std::array<Vec3, 2>& edge, const std::array<Vec3, 3>& triangle) {
    const auto& [a, b, c] = triangle;
    const int at_begin = side(a, b, c, edge[0]), at_end = side(a, b, c, edge[1]);
    if (at_begin * at_end > 0) return false;
    int least = 1, most = -1;
    bool certain = at_begin != 0 && at_end != 0;
    for (int k = 0; k < 3; ++k) {
        const int turn = side(edge[0], edge[1], triangle[k], triangle[(k + 1) % 3]);
        least = std::min(least, turn);
        most = std::max(most, turn);
        certain = certain && turn != 0;
    }
    if (least < 0 && most > 0) return false;
    if (certain) return true;
    // Here an end is near the plane, or the edge near a side of the triangle, or all of it near one plane: the
    // distance decides.
    double distance = std::numeric_limits<double>::infinity(), size = 0.0;
    for (int k = 0; k < 3; ++k) {
        distance = std::min(distance, pair_distance(PairKind::edge_edge,
                                                    {edge[0], edge[1], triangle[k], triangle[(k + 1) % 3]}));
        size = std::max(size, triangle[k].cwiseAbs().maxCoeff());
    }
    for (const Vec3& end : edge) {
        distance = std::min(distance, pair_distance(PairKind::point_triangle, {end, a, b, c}));
        size = std::max(size, end.cwiseAbs().maxCoeff());
    }
    return distance <= round_off * size;
}

}  // namespace magshell
