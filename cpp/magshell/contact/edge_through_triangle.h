// Whether an edge and a triangle have a point in common.
#pragma once

#include <array>

#include "magshell/core/types.h"

namespace magshell {

/// Also where they are so near that round-off does not tell.
bool passes_through(const std::array<Vec3, 2>& edge, const std::array<Vec3, 3>& triangle);

}  // namespace magshell
