// Contact between bodies as the caller describes it.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "magshell/core/types.h"

namespace magshell {

/// A surface that takes part in contact: the triangles of a body, or of a part of it.
struct ContactSurfaceInput {
    std::string name;                         // of the body
    std::vector<std::array<Index, 3>> faces;  // in the caller's numbering of vertices
    std::vector<Index> numbers;               // number of each face in its body
};

/// A contact between two surfaces; between a surface and itself if both are the same.
struct BodyContactInput {
    Index a, b;
    bool penalty = false;  // false: a barrier
    bool has_friction = false,
         lagged = false;  // lagged: friction uses the normal forces of the beginning of the step
};

}  // namespace magshell
