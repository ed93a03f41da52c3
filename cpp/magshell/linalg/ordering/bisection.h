// Bisection of a set of nodes of a graph by a separator.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "magshell/linalg/ordering/node_graph.h"

namespace magshell {

/// The position of a node: on a side of the current cut, between the sides, or settled by an earlier cut. Nodes
/// of two different sets are never adjacent, so threads may cut different sets at the same time.
enum class Side : std::int8_t { left, right, between, settled };

inline Side other(Side side) {
    return side == Side::left ? Side::right : Side::left;
}

/// Work data of cuts, one entry per node of the whole graph.
struct CutState {
    explicit CutState(const NodeGraph& graph);

    std::vector<Side> side;
    std::vector<double> reach;       // [m] distance to the farthest neighbour; empty without points
    std::vector<Index> level;        // level in a breadth-first search
    std::vector<double> coordinate;  // coordinate along which a cut is searched
    std::vector<Index> place;        // rank by that coordinate
    // for nodes of a separator: weight of their neighbours on each side
    std::vector<std::array<Index, 2>> beside;
    std::vector<char> has_moved;  // true: moved out of a separator
};

/// Cuts `nodes`, all of them Side::left before, into two sides of about the same size, and returns the
/// separator between them. Candidates are planes perpendicular to the directions in which the nodes extend, and
/// levels of a breadth-first search from a node at an end, each near the middle. The lighter border of the best
/// candidate, or where it matters of each good one, is refined, and the lightest separator is taken. If there
/// is no cut, all nodes stay on the left.
std::vector<Index> bisect(const NodeGraph& graph, const std::vector<Index>& nodes, CutState& state);

/// Refines a separator (Fiduccia and Mattheyses 1982): moves its nodes to a side, and their neighbours from the other side into it, while that makes
/// it lighter or the sides more balanced. It also tries a few moves that make it heavier, which are undone if
/// they lead to no improvement. Neither side grows beyond 3/5 of the nodes' weight unless it was larger before.
void refine_separator(const NodeGraph& graph, const std::vector<Index>& nodes, std::vector<Index>& separator,
                      CutState& state);

}  // namespace magshell
