// HalfEdge: the sides of all faces, sorted by the edge they lie on.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "magshell/mesh/triangle_mesh.h"

namespace magshell {

/// One side of one face: the one opposite its vertex `corner`.
struct HalfEdge {
    Index low, high;  // the edge's vertices
    Index face;
    std::int8_t corner;
    bool forward;  // true: the face runs the edge from low to high
};

/// Returns all 3 n_f half-edges, sorted by low, high and face. A counting sort by low leaves a handful to
/// compare at each vertex, so the time is linear in the number of faces.
inline std::vector<HalfEdge> sorted_half_edges(const Rows3i& faces, Index n_vertices) {
    const auto ends = [&](Eigen::Index face, int corner) {
        return std::pair(faces(face, (corner + 1) % 3), faces(face, (corner + 2) % 3));
    };
    std::vector<Index> begin(n_vertices + 1, 0);
    for (Eigen::Index f = 0; f < faces.rows(); ++f) {
        for (int i = 0; i < 3; ++i) {
            const auto [from, to] = ends(f, i);
            ++begin[std::min(from, to) + 1];
        }
    }
    for (Index v = 0; v < n_vertices; ++v) begin[v + 1] += begin[v];

    std::vector<HalfEdge> sorted(3 * faces.rows());
    std::vector<Index> next(begin.begin(), begin.end() - 1);
    for (Eigen::Index f = 0; f < faces.rows(); ++f) {
        for (int i = 0; i < 3; ++i) {
            const auto [from, to] = ends(f, i);
            const auto [low, high] = std::minmax(from, to);
            sorted[next[low]++] = {low, high, static_cast<Index>(f), static_cast<std::int8_t>(i), from < to};
        }
    }
    for (Index v = 0; v < n_vertices; ++v) {
        std::stable_sort(sorted.begin() + begin[v], sorted.begin() + begin[v + 1],
                         [](const HalfEdge& a, const HalfEdge& b) { return a.high < b.high; });
    }
    return sorted;
}

}  // namespace magshell
