// Refinement of separators by moving single nodes (Fiduccia and Mattheyses 1982).
#pragma once

#include <vector>

#include "magshell/linalg/ordering/bisection.h"

namespace magshell {

/// Moves nodes of the separator to a side, and their neighbours from the other side into it, while that makes
/// it lighter or the sides more balanced. It also tries a few moves that make it heavier, which are undone if
/// they lead to no improvement. Neither side grows beyond 3/5 of the nodes' weight unless it was larger before.
void refine_separator(const NodeGraph& graph, const std::vector<Index>& nodes, std::vector<Index>& separator,
                      CutState& state);

}  // namespace magshell
