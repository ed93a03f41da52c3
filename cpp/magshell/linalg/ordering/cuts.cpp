#include "magshell/linalg/ordering/cuts.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "magshell/linalg/ordering/bisection.h"

namespace magshell {

// Sorted by coordinate, a node belongs to the left border of every cut between it and its farthest neighbour to
// the right, and to the right border the other way round. The weights of all borders are therefore cumulative
// sums.
Cut lightest_cut(const NodeGraph& graph, const std::vector<Index>& nodes, CutState& state) {
    // [-] of the whole weight, from the middle; fixed by test_best_ordering_needs_few_operations_beside_amd_and_metis
    constexpr double farthest = 0.2;
    const Index count = static_cast<Index>(nodes.size());
    std::vector<std::pair<double, Index>>
        sorted;  // coordinates next to their nodes, whose data are scattered in memory
    sorted.reserve(nodes.size());
    for (const Index node : nodes) sorted.emplace_back(state.coordinate[node], node);
    std::sort(sorted.begin(), sorted.end());
    // The rank of a node is that of the first node with the same coordinate.
    std::vector<Index>& place = state.place;
    double whole = 0.0;
    for (Index k = 0; k < count; ++k) {
        const auto [coordinate, node] = sorted[k];
        const bool alike = k > 0 && sorted[k - 1].first == coordinate;
        place[node] = alike ? place[sorted[k - 1].second] : k;
        whole += graph.weights[node];
    }
    // changes of the borders' weights from cut to cut
    std::vector<Index> left(count + 1, 0), right(count + 1, 0);
    for (const auto& [coordinate, node] : sorted) {
        Index first = place[node], last = first;
        for (const Index beside : graph.around(node)) {
            if (state.side[beside] == Side::settled) continue;
            first = std::min(first, place[beside]);
            last = std::max(last, place[beside]);
        }
        const Index weight = graph.weights[node];
        left[place[node] + 1] += weight;
        left[last + 1] -= weight;
        right[first + 1] += weight;
        right[place[node] + 1] -= weight;
    }
    Cut cut;
    double below = 0.0;
    Index borders[2] = {0, 0};
    for (Index k = 0; k < count; ++k) {
        borders[0] += left[k];
        borders[1] += right[k];
        const double off = std::abs(below / whole - 0.5);
        below += graph.weights[sorted[k].second];
        if (k == 0 || place[sorted[k].second] != k) continue;
        const Index weight = std::min(borders[0], borders[1]);
        // Beyond the limit only the balance of the cut counts.
        const double cost = off > farthest ? (1.0 + off) * 2.0 * whole : cost_of_cut(weight, off);
        if (cost >= cut.cost) continue;
        cut = {
            .weight = weight, .cost = cost, .left_border = borders[0] <= borders[1], .at = sorted[k].first};
    }
    return cut;
}

}  // namespace magshell
