// Shape functions and integration points of quadratic triangles: corners 0, 1, 2, then the middle nodes of the
// edges 0-1, 1-2, 2-0.
//
// Edge i is opposite corner i and runs from corner i + 1 to corner i + 2; t_i is its vector in the reference
// triangle. Quantities on an edge are evaluated at its two Gauss points, quantities inside the face at the six
// points of a symmetric rule that is exact to fourth degree.
#pragma once

#include <array>

namespace magshell::six_nodes {

/// Returns the middle node of the edge opposite corner i.
constexpr int middle(int i) {
    return 3 + (i + 1) % 3;
}

/// Gauss points of an edge: (1 -+ 1/sqrt(3)) / 2, each with weight 1/2.
constexpr std::array<double, 2> gauss = {0.21132486540518711775, 0.78867513459481288225};

/// Returns the derivatives with respect to s, at position s of an edge, of the shape functions of its two ends and its
/// middle node.
constexpr std::array<double, 3> along(double s) {
    return {4.0 * s - 3.0, 4.0 * s - 1.0, 4.0 - 8.0 * s};
}

/// Returns the derivatives towards the opposite corner, at position s of an edge, of the shape functions of:
/// the ends `from` and `to`, the middle node, the opposite corner, and the middle nodes between `to` and it and
/// between it and `from`.
constexpr std::array<double, 6> inward(double s) {
    return {(4.0 * s - 3.0) * (1.0 - s),
            (1.0 - 4.0 * s) * s,
            -8.0 * s * (1.0 - s),
            -1.0,
            4.0 * s,
            4.0 * (1.0 - s)};
}

struct Point {
    std::array<double, 3> at;  // barycentric coordinates
    double weight;             // fraction of the triangle's area
};

constexpr std::array<Point, 6> inside = [] {
    std::array<Point, 6> points{};
    constexpr double places[2] = {0.44594849091596488632, 0.09157621350977074346},
                     weights[2] = {0.22338158967801146570, 0.10995174365532186764};
    for (int ring = 0; ring < 2; ++ring)
        for (int k = 0; k < 3; ++k) {
            Point& point = points[3 * ring + k];
            for (int i = 0; i < 3; ++i) point.at[i] = i == k ? 1.0 - 2.0 * places[ring] : places[ring];
            point.weight = weights[ring];
        }
    return points;
}();

/// Returns the derivatives of the six shape functions along t_i, at a point given by barycentric coordinates.
constexpr std::array<double, 6> derivative(int i, const std::array<double, 3>& at) {
    double rate[3] = {};
    rate[(i + 1) % 3] = -1.0;
    rate[(i + 2) % 3] = 1.0;
    std::array<double, 6> by_node{};
    for (int k = 0; k < 3; ++k) {
        const int a = (k + 1) % 3, b = (k + 2) % 3;
        by_node[k] = (4.0 * at[k] - 1.0) * rate[k];
        by_node[middle(k)] = 4.0 * (at[a] * rate[b] + at[b] * rate[a]);
    }
    return by_node;
}

/// Returns these derivatives along t_i, times a sign, at each of the six interior points.
constexpr std::array<std::array<double, 6>, 6> inside_towards(int i, double sign) {
    std::array<std::array<double, 6>, 6> all{};
    for (int p = 0; p < 6; ++p) {
        all[p] = derivative(i, inside[p].at);
        for (double& by_node : all[p]) by_node *= sign;
    }
    return all;
}

/// Returns the values of the six shape functions at a point given by barycentric coordinates.
constexpr std::array<double, 6> shapes(const std::array<double, 3>& at) {
    std::array<double, 6> by_node{};
    for (int k = 0; k < 3; ++k) {
        by_node[k] = at[k] * (2.0 * at[k] - 1.0);
        by_node[middle(k)] = 4.0 * at[(k + 1) % 3] * at[(k + 2) % 3];
    }
    return by_node;
}

/// Returns one of the three linear test functions of direction i at a point: functions 0 and 1 are 1 at one
/// Gauss point of edge i, 0 at the other and 0 at the opposite corner; function 2 is the barycentric coordinate
/// of that corner.
constexpr double test(int i, int which, const std::array<double, 3>& at) {
    if (which == 2) return at[i];
    // Values at the two ends of the edge, of the line through 1 at one Gauss point and 0 at the other.
    const double first = gauss[which], other = gauss[1 - which];
    const double from = -other / (first - other), to = (1.0 - other) / (first - other);
    return from * at[(i + 1) % 3] + to * at[(i + 2) % 3];
}

}  // namespace magshell::six_nodes
