#include "magshell/contact/overcount_correction.h"

#include <algorithm>
#include <cmath>

namespace magshell {
namespace {

/// A vertex or an edge of one of the triangles near a point.
struct Shared {
    std::array<Index, 2> nodes;  // lower first; twice the same for a vertex
    std::size_t from;            // index of the pair

    bool operator<(const Shared& other) const { return nodes < other.nodes; }
};

/// Calls visit(first, count) for each group of equal entries.
template <class Visit>
void each_group(const std::vector<Shared>& all, const Visit& visit) {
    for (std::size_t k = 0, after; k < all.size(); k = after) {
        for (after = k + 1; after < all.size() && all[after].nodes == all[k].nodes;) ++after;
        visit(k, static_cast<int>(after - k));
    }
}

}  // namespace

// Counts triangles minus shared edges plus vertices, which is 1 for any region of a surface without holes
// (Euler characteristic). Neighbouring parts with a reduced activation distance do not count, because each has
// a law of its own.
void add_overcount_corrections(std::size_t first, const double* q, double margin,
                               std::vector<NearPair>& all) {
    std::vector<Shared> edges, vertices;
    std::vector<int> shared;  // number of shared edges at each vertex, at its first entry
    const auto add = [&](const Shared& shared, PairKind kind, int times) {
        NearPair near = all[shared.from];
        near.pair.kind = kind;
        near.pair.area *= times;
        near.pair.nodes = {near.pair.nodes[0], shared.nodes[0],
                           kind == PairKind::point_edge ? shared.nodes[1] : -1, -1};
        if (pair_distance(kind, positions_of(near.pair, q)) < margin) all.push_back(near);
    };
    const std::size_t end = all.size();
    for (std::size_t begin = first, next; begin < end; begin = next) {
        const Index point = all[begin].pair.nodes[0];
        for (next = begin + 1; next < end && all[next].pair.nodes[0] == point;) ++next;
        if (next == begin + 1) continue;
        edges.clear();
        vertices.clear();
        for (std::size_t k = begin; k < next; ++k) {
            if (std::isfinite(all[k].pair.room)) continue;
            const std::array<Index, 4>& nodes = all[k].pair.nodes;
            for (int i = 1; i < 4; ++i) {
                const auto [low, high] = std::minmax(nodes[i], nodes[i % 3 + 1]);
                edges.push_back({{low, high}, k});
                vertices.push_back({{nodes[i], nodes[i]}, k});
            }
        }
        std::stable_sort(edges.begin(), edges.end());
        std::stable_sort(vertices.begin(), vertices.end());
        shared.assign(vertices.size(), 0);
        const auto place_of = [&](Index node) {
            return std::lower_bound(vertices.begin(), vertices.end(), Shared{{node, node}, 0}) -
                   vertices.begin();
        };
        each_group(edges, [&](std::size_t k, int count) {
            if (count == 1) return;
            for (Index node : edges[k].nodes) shared[place_of(node)] += count - 1;
            add(edges[k], PairKind::point_edge, 1 - count);
        });
        each_group(vertices, [&](std::size_t k, int count) {
            const int times = 1 - count + shared[k];
            if (times != 0) add(vertices[k], PairKind::point_point, times);
        });
    }
}

}  // namespace magshell
