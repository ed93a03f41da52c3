// Positions relative to the first node. Differences of coordinates then keep their digits far from the origin,
// and a flat face along the axes stays flat to the last bit.
#pragma once

#include <array>

#include "magshell/energy/symmetric3.h"

namespace magshell {

template <int count>
std::array<SimdVec3, count> relative_to_first_node(const SimdVec3 x[count]) {
    std::array<SimdVec3, count> seen;
    seen[0] = {SimdDouble(0.0), SimdDouble(0.0), SimdDouble(0.0)};
    for (int a = 1; a < count; ++a) seen[a] = x[a] - x[0];
    return seen;
}

}  // namespace magshell
