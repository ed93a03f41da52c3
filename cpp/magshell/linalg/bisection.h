// A set of nodes cut in two halves and what separates them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "magshell/linalg/node_graph.h"

namespace magshell {

/// Where a node is: on a side of the cut that is being made, between the sides, or settled by an earlier cut.
/// Nodes of two sets are never neighbours, so that threads may cut different sets at the same time.
enum class Side : std::int8_t { left, right, between, settled };

inline Side other(Side side) {
    return side == Side::left ? Side::right : Side::left;
}

/// What cuts need to know of all nodes, an entry each.
struct CutState {
    explicit CutState(const NodeGraph& graph);

    std::vector<Side> side;
    std::vector<double> reach;                 // [m] to the farthest neighbour; empty without points
    std::vector<Index> level;                  // room for a search from neighbour to neighbour
    std::vector<double> coordinate;            // along which a cut is being looked for
    std::vector<Index> place;                  // among others by that coordinate
    std::vector<std::array<Index, 2>> beside;  // of a separator's nodes: how much of each side they touch
    std::vector<char> has_moved;               // out of a separator
};

/// Cuts `nodes`, all of them Side::left before, into sides of about the same number, and puts between them what separates
/// them: returns it. Tried are planes across the directions in which the nodes extend, and the ways from a node at an end,
/// near the middle of each: the lighter border of the two sides of the best, or where cuts matter of each of the best,
/// is refined, and the lightest of those taken. Where no cut can be, all stay on the left.
std::vector<Index> bisect(const NodeGraph& graph, const std::vector<Index>& nodes, CutState& state);

}  // namespace magshell
