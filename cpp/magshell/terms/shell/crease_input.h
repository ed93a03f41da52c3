// CreaseInput: the description of the creases of a shell that share their parameters.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "magshell/core/types.h"

namespace magshell {

struct CreaseInput {
    std::string owner;
    // The caller's vertices of each edge: start, end, and the third vertices of the faces on its left and right.
    std::vector<std::array<Index, 4>> edges;
    // Rows of each parameter: one for all edges or one each; 0 for `angle`: edges are at rest as they are in the reference shape.
    Index stiffness_rows = 1, angle_rows = 0;
};

}  // namespace magshell
