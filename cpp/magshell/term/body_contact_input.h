// Contact of bodies as the caller describes it.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "magshell/core/types.h"

namespace magshell {

/// Triangles that touch others: of a body, or of a part of it.
struct ContactSurfaceInput {
    std::string name;                         // of the body
    std::vector<std::array<Index, 3>> faces;  // the caller's vertices
    std::vector<Index> numbers;               // of the faces in the body
};

/// Surfaces that touch each other; one and the same: itself.
struct BodyContactInput {
    Index a, b;
    bool penalty = false;  // else a barrier
    bool has_friction = false,
         lagged = false;  // whether there is friction, and whether with the normal force of before
};

}  // namespace magshell
