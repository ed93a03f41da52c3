#include "magshell/linalg/ordering/node_graph.h"

#include <algorithm>

namespace magshell {

NodeGraph node_graph(const Quotient& quotient, const std::vector<Vec3>& points) {
    const SparsePattern& lower = quotient.pattern;
    NodeGraph graph;
    graph.starts.assign(lower.size + 1, 0);
    const auto each_pair = [&](auto&& visit) {
        for (Index j = 0; j < lower.size; ++j)
            for (Index k = lower.column_starts[j] + 1; k < lower.column_starts[j + 1]; ++k)
                visit(j, lower.rows[k]);
    };
    each_pair([&](Index j, Index i) {
        ++graph.starts[i + 1];
        ++graph.starts[j + 1];
    });
    for (Index j = 0; j < lower.size; ++j) graph.starts[j + 1] += graph.starts[j];
    graph.neighbours.resize(graph.starts[lower.size]);
    std::vector<Index> next(graph.starts.begin(), graph.starts.end() - 1);
    each_pair([&](Index j, Index i) {
        graph.neighbours[next[i]++] = j;
        graph.neighbours[next[j]++] = i;
    });
    graph.weights.reserve(lower.size);
    for (Index node = 0; node < lower.size; ++node) {
        graph.weights.push_back(static_cast<Index>(quotient.members(node).size()));
        if (!points.empty()) graph.points.push_back(points[quotient.members(node).front()]);
    }
    return graph;
}

std::vector<char> leaders(const NodeGraph& graph) {
    std::vector<char> leads(graph.size(), true);
    for (Index node = 0; node < graph.size(); ++node) {
        const std::span<const Index> around = graph.around(node);
        const auto heavier = std::count_if(around.begin(), around.end(), [&](Index other) {
            return graph.weights[other] > graph.weights[node];
        });
        leads[node] = 2 * heavier <= static_cast<std::ptrdiff_t>(around.size());
    }
    const std::vector<char> first = leads;
    for (Index node = 0; node < graph.size(); ++node) {
        const std::span<const Index> around = graph.around(node);
        if (std::none_of(around.begin(), around.end(), [&](Index other) { return first[other]; }))
            leads[node] = true;
    }
    return leads;
}

NodeGraph induced(const NodeGraph& graph, const std::vector<Index>& nodes, const std::vector<Index>& number) {
    NodeGraph part;
    part.starts.reserve(nodes.size() + 1);
    part.starts.push_back(0);
    for (const Index node : nodes) {
        for (const Index other : graph.around(node))
            if (number[other] >= 0) part.neighbours.push_back(number[other]);
        part.starts.push_back(static_cast<Index>(part.neighbours.size()));
        part.weights.push_back(graph.weights[node]);
        if (!graph.points.empty()) part.points.push_back(graph.points[node]);
    }
    return part;
}

}  // namespace magshell
