// A numbering along a space-filling curve, which keeps neighbours close in memory, whatever the order of the
// caller's mesh.
#pragma once

#include <vector>

#include "magshell/core/renumbering.h"

namespace magshell {

/// Numbers points along a Morton curve through them; points with equal keys keep their order.
Renumbering order_along_curve(const std::vector<Vec3>& points);

}  // namespace magshell
