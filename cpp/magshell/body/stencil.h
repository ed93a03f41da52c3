// The dofs that an element couples.
#pragma once

#include <array>
#include <span>

#include "magshell/core/types.h"

namespace magshell {

/// A fixed number of nodes and scalar dofs. Negative entries are absent.
struct Stencil {
    std::array<Index, 6> nodes{-1, -1, -1, -1, -1, -1};
    std::array<Index, 3> rotations{-1, -1, -1};
};

/// Any number of nodes and scalar dofs, stored elsewhere.
struct Clique {
    std::span<const Index> nodes, scalars = {};
};

}  // namespace magshell
