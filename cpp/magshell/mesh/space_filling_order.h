// Numbering that keeps neighbours together in memory, whatever order the caller's mesh came in.
#pragma once

#include <vector>

#include "magshell/core/renumbering.h"

namespace magshell {

/// Along a space-filling (Morton) curve through the points; equal keys keep their order.
Renumbering order_along_curve(const std::vector<Vec3>& points);

}  // namespace magshell
