// Which unknowns an element couples.
#pragma once

#include <array>
#include <span>

#include "magshell/core/types.h"

namespace magshell {

/// Nodes, and scalars. Negative: absent.
struct Stencil {
    std::array<Index, 6> nodes{-1, -1, -1, -1, -1, -1};
    std::array<Index, 3> rotations{-1, -1, -1};
};

/// The same of any size, held elsewhere.
struct Clique {
    std::span<const Index> nodes, scalars = {};
};

}  // namespace magshell
