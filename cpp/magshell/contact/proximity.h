// Proximity: the distance of two parts of surfaces, with its derivatives: a point and a triangle, two edges, a
// point and an edge, or two points.
//
//   P(x, s) = sum_i w_i(s) x_i,   d = min_s |P|                                            [m]
//
// P points from a point of the second part to one of the first; s are their parameters (barycentric, or along
// edges). A parameter is free if it is not at an end; there are zero, one or two free ones. In the orthonormal
// basis of n = P/d, f_1 and f_2, where the first of the f_a span dP/ds (f_a . P = 0 at the minimum), and with
// w_a' the change of the weights per metre along f_a, all derivatives have low rank:
//
//   d_i   = w_i n                                                  envelope theorem: ds does not contribute
//   d_ij  = - sum_free [d w_ai' w_aj' n n^T + w_ai' w_j n f_a^T + w_i w_aj' f_a n^T]  +  w_i w_j/d sum_fixed f_a f_a^T
//   dw_i  = - sum_free w_ai' (d w_aj' n + w_j f_a) . dx_j
//   dn    = - sum_free f_a (w_aj' n . dx_j)  +  1/d sum_fixed f_a (w_j f_a . dx_j)
//
// With two free parameters there is no division by d.
#pragma once

#include <array>
#include <cstdint>

#include "magshell/core/types.h"

namespace magshell {

/// The kinds of pairs, with their nodes in this order.
enum class PairKind : std::uint8_t {
    point_triangle,  // point; three corners
    edge_edge,       // two ends; two ends
    point_edge,      // point; two ends
    point_point,     // point; point
};

/// Returns the number of nodes of a pair: 4, 4, 3, 2. Entries for further nodes are not read.
constexpr int nodes_of(PairKind kind) {
    return kind == PairKind::point_point ? 2 : kind == PairKind::point_edge ? 3 : 4;
}

/// The positions of a pair's nodes [m].
using PairPositions = std::array<Vec3, 4>;
/// A number per node.
using PairWeights = std::array<double, 4>;

struct Proximity {
    double distance;       // [m]
    PairWeights weights;   // of the difference of the closest points: first part positive, second negative
    int free;              // number of free parameters
    Vec3 normal;           // n, a unit vector; zero where the parts meet with fewer than two free parameters
    Vec3 along[2];         // f_a
    PairWeights slide[2];  // w_a' [1/m]; zero for fixed parameters
};

/// Returns the closest points of a pair. Degenerate triangles and edges, and parallel edges, are allowed.
Proximity proximity(PairKind kind, const PairPositions& x);

/// Computes the same if the parts are closer than `reach` [m] and returns true; otherwise returns false at less
/// cost.
bool proximity_within(PairKind kind, const PairPositions& x, double reach, Proximity& near);

/// Returns the distance only [m].
double pair_distance(PairKind kind, const PairPositions& x);

}  // namespace magshell
