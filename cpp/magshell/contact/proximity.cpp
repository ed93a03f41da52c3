#include "magshell/contact/proximity.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace magshell {
namespace {

/// Squared sine of the angle below which two directions count as parallel. [-] The closest point is then also
/// at an end, up to a relative error of 1e-16 of any distance above 1e-5 of their lengths. Fixed by
/// test_distances_are_those_of_ipctk.
constexpr double parallel = 1e-22;

/// The closest points found so far: weights, and the nodes that lose and gain weight as the free points move.
struct Closest {
    double squared = std::numeric_limits<double>::infinity();
    PairWeights weights{};
    int free = 0;
    int less[2] = {0, 0}, more[2] = {0, 0};
};

/// Compares a point `p` of one part with the edge from node a to node b of the other; sign: that of the edge's
/// weights.
void try_point_edge(const PairPositions& x, int p, int a, int b, double sign, Closest& best) {
    const Vec3 along = x[b] - x[a], to = x[p] - x[a];
    const double squared_length = along.squaredNorm(), projected = along.dot(to);
    double s = 0.0;
    bool free = false;
    if (projected > 0.0 && squared_length > 0.0) {
        s = projected / squared_length;
        free = s < 1.0;
        if (!free) s = 1.0;
    }
    const double squared = (s < 1.0 ? Vec3(to - s * along) : Vec3(x[p] - x[b])).squaredNorm();
    if (squared >= best.squared) return;
    best = {};
    best.squared = squared;
    best.weights[p] = -sign;
    best.weights[a] = sign * (1.0 - s);
    best.weights[b] = sign * s;
    best.free = free ? 1 : 0;
    // The weights of a second part are negative, so they change the other way along the edge.
    best.less[0] = sign > 0.0 ? a : b;
    best.more[0] = sign > 0.0 ? b : a;
}

/// Coordinates in the plane of two vectors: to = first one + second two + a part perpendicular to both.
struct InPlane {
    bool told = false;  // false if the two are parallel
    double first, second;
    double squared_height;

    InPlane(const Vec3& one, const Vec3& two, const Vec3& to) {
        const Vec3 normal = one.cross(two);
        const double squared_area = normal.squaredNorm();
        if (!(squared_area > parallel * one.squaredNorm() * two.squaredNorm())) return;
        told = true;
        const double height = normal.dot(to);
        first = to.cross(two).dot(normal) / squared_area;
        second = one.cross(to).dot(normal) / squared_area;
        squared_height = height * height / squared_area;
    }
};

Closest closest_point_triangle(const PairPositions& x) {
    const InPlane at(x[2] - x[1], x[3] - x[1], x[0] - x[1]);
    if (at.told && at.first > 0.0 && at.second > 0.0 && at.first + at.second < 1.0)
        return {
            at.squared_height, {1.0, at.first + at.second - 1.0, -at.first, -at.second}, 2, {2, 3}, {1, 1}};
    Closest best;
    try_point_edge(x, 0, 1, 2, -1.0, best);
    try_point_edge(x, 0, 2, 3, -1.0, best);
    try_point_edge(x, 0, 3, 1, -1.0, best);
    return best;
}

Closest closest_edge_edge(const PairPositions& x) {
    const InPlane at(x[1] - x[0], x[2] - x[3], x[2] - x[0]);
    if (at.told && at.first > 0.0 && at.first < 1.0 && at.second > 0.0 && at.second < 1.0)
        return {
            at.squared_height, {1.0 - at.first, at.first, at.second - 1.0, -at.second}, 2, {0, 3}, {1, 2}};
    Closest best;
    try_point_edge(x, 0, 2, 3, -1.0, best);
    try_point_edge(x, 1, 2, 3, -1.0, best);
    try_point_edge(x, 2, 0, 1, 1.0, best);
    try_point_edge(x, 3, 0, 1, 1.0, best);
    return best;
}

Closest closest(PairKind kind, const PairPositions& x) {
    if (kind == PairKind::point_triangle) return closest_point_triangle(x);
    if (kind == PairKind::edge_edge) return closest_edge_edge(x);
    Closest best;
    if (kind == PairKind::point_edge) {
        try_point_edge(x, 0, 1, 2, -1.0, best);
        return best;
    }
    best.squared = (x[0] - x[1]).squaredNorm();
    best.weights = {1.0, -1.0, 0.0, 0.0};
    return best;
}

/// Returns a unit vector perpendicular to n.
Vec3 across(const Vec3& n) {
    int smallest;
    n.cwiseAbs().minCoeff(&smallest);
    return n.cross(Vec3::Unit(smallest)).normalized();
}

Proximity completed(PairKind kind, const PairPositions& x, const Closest& at) {
    Proximity near;
    near.weights = at.weights;
    near.free = at.free;
    near.slide[0] = near.slide[1] = {};
    Vec3 difference = Vec3::Zero();
    for (int i = 0; i < nodes_of(kind); ++i) difference += at.weights[i] * x[i];
    // Gram-Schmidt orthogonalization of dP/ds_a = x[more] - x[less], and with it of dw/ds_a.
    for (int a = 0; a < at.free; ++a) {
        Vec3 way = x[at.more[a]] - x[at.less[a]];
        PairWeights& slide = near.slide[a];
        slide[at.more[a]] = 1.0;
        slide[at.less[a]] = -1.0;
        if (a == 1) {
            const double share = way.dot(near.along[0]);
            way -= share * near.along[0];
            for (int i = 0; i < 4; ++i) slide[i] -= share * near.slide[0][i];
        }
        const double per_length = 1.0 / way.norm();
        near.along[a] = per_length * way;
        for (int i = 0; i < 4; ++i) slide[i] *= per_length;
        difference -= near.along[a].dot(difference) * near.along[a];
    }
    if (at.free == 2) {
        // This is more accurate than the difference of two points that are close to each other.
        near.normal = near.along[0].cross(near.along[1]).normalized();
        near.distance = near.normal.dot(difference);
        if (near.distance < 0.0) {
            near.distance = -near.distance;
            near.normal = -near.normal;
        }
        return near;
    }
    near.distance = difference.norm();
    near.normal = near.distance > 0.0 ? Vec3(difference / near.distance) : Vec3(Vec3::Zero());
    if (at.free == 0) near.along[0] = across(near.normal);
    near.along[1] = near.normal.cross(near.along[0]);
    return near;
}

}  // namespace

Proximity proximity(PairKind kind, const PairPositions& x) {
    return completed(kind, x, closest(kind, x));
}

bool proximity_within(PairKind kind, const PairPositions& x, double reach, Proximity& near) {
    const Closest at = closest(kind, x);
    if (!(at.squared < reach * reach)) return false;
    near = completed(kind, x, at);
    return near.distance < reach;
}

double pair_distance(PairKind kind, const PairPositions& x) {
    return std::sqrt(closest(kind, x).squared);
}

}  // namespace magshell
