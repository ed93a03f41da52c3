// Cuts of a set of nodes in two along a coordinate.
#pragma once

#include <limits>
#include <vector>

#include "magshell/linalg/ordering/node_graph.h"

namespace magshell {

struct CutState;

/// A cut: nodes whose coordinate is less than `at` go to the left.
struct Cut {
    Index weight = std::numeric_limits<Index>::max();  // of the lighter border; this value if there is no cut
    // cost of the cut, comparable among cuts of the same nodes
    double cost = std::numeric_limits<double>::max();
    bool left_border = true;  // true: that border is on the left side
    double at = 0.0;
};

/// Returns the cost of a separator that leaves one side larger than half by the fraction `off` of the whole.
inline double cost_of_cut(double weight, double off) {
    // [-] penalty of imbalance: weight factor of off^2; fixed by test_best_ordering_needs_few_operations_beside_amd_and_metis
    constexpr double uneven = 8.0;
    return weight * (1.0 + uneven * off * off);
}

/// Returns the cut along state.coordinate with the lightest border, among those that leave neither side much
/// larger than half; a less balanced cut needs a lighter border.
Cut lightest_cut(const NodeGraph& graph, const std::vector<Index>& nodes, CutState& state);

}  // namespace magshell
