// Blocks [axis]x of a Hessian.
#pragma once

#include "magshell/core/vector3.h"

namespace magshell {

/// [axis]x in the first lane of a block whose diagonal is zero.
inline void set_skew(Pack33& block, const Vec3& axis) {
    block.at[1].set(0, -axis.z());
    block.at[2].set(0, axis.y());
    block.at[3].set(0, axis.z());
    block.at[5].set(0, -axis.x());
    block.at[6].set(0, -axis.y());
    block.at[7].set(0, axis.x());
}

}  // namespace magshell
