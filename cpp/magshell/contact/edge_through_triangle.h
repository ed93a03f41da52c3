// Intersection test of an edge with a triangle.
#pragma once

#include <array>

#include "magshell/core/types.h"

namespace magshell {

/// Returns true if an edge and a triangle intersect, also if they are so close that round-off leaves it open.
bool passes_through(const std::array<Vec3, 2>& edge, const std::array<Vec3, 3>& triangle);

}  // namespace magshell
