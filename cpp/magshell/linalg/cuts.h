// Cuts of a set of nodes in two along a coordinate.
#pragma once

#include <limits>
#include <vector>

#include "magshell/linalg/node_graph.h"

namespace magshell {

struct CutState;

/// Nodes whose coordinate is less than `at` go to the left.
struct Cut {
    Index weight = std::numeric_limits<Index>::max();  // of the lighter border; this where there is no cut
    double cost = std::numeric_limits<double>::max();  // of the cut, to compare with others of the same nodes
    bool left_border = true;                           // whether that border is the left side's
    double at = 0.0;
};

/// What a separator costs that leaves one side so much more than half of the whole.
inline double cost_of_cut(double weight, double off) {
    constexpr double uneven = 8.0;  // times the square of that makes it so much heavier
    return weight * (1.0 + uneven * off * off);
}

/// The cut along state.coordinate with the lightest border, of those that leave neither side much more than half; the more
/// one does, the lighter the border has to be.
Cut lightest_cut(const NodeGraph& graph, const std::vector<Index>& nodes, CutState& state);

}  // namespace magshell
