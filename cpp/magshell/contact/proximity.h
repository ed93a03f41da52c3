// How near two small parts of surfaces are: a point and a triangle, two edges, a point and an edge, two points.
//
//   P(x, s) = sum_i w_i(s) x_i,   d = min_s |P|                                            [m]
//
// P runs from a point of the second part to one of the first; s are their places (barycentric, along edges), of
// which those at no end are free: none, one or two. In the orthonormal basis of n = P/d and f_1, f_2, the first of
// which span what dP/ds does (f_a . P = 0 at the minimum), and with w_a' the change of the weights when the place
// moves by one metre along f_a, everything is of low rank:
//
//   d_i   = w_i n                                                  the envelope: ds does not matter
//   d_ij  = - sum_free [d w_ai' w_aj' n n^T + w_ai' w_j n f_a^T + w_i w_aj' f_a n^T]  +  w_i w_j/d sum_fixed f_a f_a^T
//   dw_i  = - sum_free w_ai' (d w_aj' n + w_j f_a) . dx_j
//   dn    = - sum_free f_a (w_aj' n . dx_j)  +  1/d sum_fixed f_a (w_j f_a . dx_j)
//
// Where two places are free there is no 1/d.
#pragma once

#include <array>
#include <cstdint>

#include "magshell/core/types.h"

namespace magshell {

/// What a pair is made of, with its nodes in this order.
enum class PairKind : std::uint8_t {
    point_triangle,  // point; three corners
    edge_edge,       // two ends; two ends
    point_edge,      // point; two ends
    point_point,     // point; point
};

/// How many nodes a pair has: 4, 4, 3, 2. What stands for the others is not read.
constexpr int nodes_of(PairKind kind) {
    return kind == PairKind::point_point ? 2 : kind == PairKind::point_edge ? 3 : 4;
}

/// Where the nodes of a pair are [m].
using PairPositions = std::array<Vec3, 4>;
/// A number for each node.
using PairWeights = std::array<double, 4>;

struct Proximity {
    double distance;       // [m]
    PairWeights weights;   // of the difference of the closest points: first part positive, second negative
    int free;              // how many places are free
    Vec3 normal;           // n, of length 1; zero where the parts touch with fewer than two free places
    Vec3 along[2];         // f_a
    PairWeights slide[2];  // w_a' [1/m]; zero from `free` on
};

/// The closest points of a pair. Degenerate triangles and edges, and parallel edges, are as good as others.
Proximity proximity(PairKind kind, const PairPositions& x);

/// The same where the parts are nearer than `reach` [m]; else false, at less cost.
bool proximity_within(PairKind kind, const PairPositions& x, double reach, Proximity& near);

/// Their distance alone [m].
double pair_distance(PairKind kind, const PairPositions& x);

}  // namespace magshell
