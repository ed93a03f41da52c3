#include "magshell/contact/neighbours.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <queue>

namespace magshell {
namespace {

constexpr double endless = std::numeric_limits<double>::infinity();
// [-] longest path between neighbours over their distance; along a half circle the ratio is 1.6. Fixed by
// test_adjacent_cells_of_a_sheet_have_smaller_thickness_than_layers
constexpr double way_round = 3.0;

}  // namespace

Neighbours::Neighbours(const std::vector<ContactSurface>& surfaces, const std::vector<Vec3>& rest)
    : rest_(rest), starts_(rest.size() + 1, 0), parts_(surfaces.size()), lengths_(rest.size(), endless) {
    for (const ContactSurface& surface : surfaces)
        for (const ContactSurface::Edge& edge : surface.edges)
            for (Index node : edge) ++starts_[node + 1];
    std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
    next_.resize(starts_.back());
    std::vector<Index> filled(starts_.begin(), starts_.end() - 1);
    for (const ContactSurface& surface : surfaces)
        for (const ContactSurface::Edge& edge : surface.edges) {
            next_[filled[edge[0]]++] = edge[1];
            next_[filled[edge[1]]++] = edge[0];
        }
    // Surfaces with a common node are connected.
    std::iota(parts_.begin(), parts_.end(), 0);
    std::vector<Index> owner(rest.size(), -1);
    for (Index s = 0; s < static_cast<Index>(surfaces.size()); ++s)
        for (Index node : surfaces[s].vertices) {
            if (owner[node] < 0) owner[node] = s;
            const auto [low, high] = std::minmax(parts_[owner[node]], parts_[s]);
            if (low != high) std::replace(parts_.begin(), parts_.end(), Index(high), Index(low));
        }
}

// Computes the shortest paths along edges from a node, up to a limit (Dijkstra).
void Neighbours::walk(Index from, double limit) {
    if (from == from_ && limit <= limit_) return;
    for (Index node : reached_) lengths_[node] = endless;
    reached_.assign(1, from);
    from_ = from;
    limit_ = limit;
    lengths_[from] = 0.0;
    using Way = std::pair<double, Index>;
    std::priority_queue<Way, std::vector<Way>, std::greater<>> open;
    open.push({0.0, from});
    while (!open.empty()) {
        const auto [length, node] = open.top();
        open.pop();
        if (length > lengths_[node]) continue;
        for (Index k = starts_[node]; k < starts_[node + 1]; ++k) {
            const Index to = next_[k];
            const double way = length + (rest_[to] - rest_[node]).norm();
            if (way > limit || way >= lengths_[to]) continue;
            if (lengths_[to] == endless) reached_.push_back(to);
            lengths_[to] = way;
            open.push({way, to});
        }
    }
}

bool Neighbours::are(const ContactPair& pair, double distance) {
    double edge = 0.0;  // longest edge of both parts
    const auto reach = [&](int i, int j) {
        edge = std::max(edge, (rest_[pair.nodes[i]] - rest_[pair.nodes[j]]).norm());
    };
    const int first = pair.kind == PairKind::edge_edge ? 2 : 1;
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < i; ++j)
            if ((i < first) == (j < first)) reach(i, j);
    const double limit = way_round * distance + 2.0 * edge;
    walk(pair.nodes[0], limit);
    return std::any_of(pair.nodes.begin() + first, pair.nodes.end(),
                       [&](Index node) { return lengths_[node] <= limit; });
}

}  // namespace magshell
