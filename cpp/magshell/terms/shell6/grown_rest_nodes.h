// Adds the gradient of a grown face by its reference shape (energy/grown_six_rest.h) to the nodes of a shell.
#pragma once

#include "magshell/energy/grown_six_rest.h"
#include "magshell/terms/shell/shell_growth.h"

namespace magshell {

/// Returns the gradient with respect to the factors s~ of the face.
inline Vec9 add_rest_nodes(const GrownSixRest& by, const ShellGrowth& growth, Index face,
                           const std::array<Index, 6>& nodes, VectorXd& out) {
    Vec9 by_lengths;
    const std::array<Vec3, 6> by_nodes = by.nodes(growth.growth(face), growth.curvature(face), by_lengths);
    for (int k = 0; k < 6; ++k) out.segment<3>(3 * nodes[k]) += by_nodes[k];
    return by_lengths;
}

}  // namespace magshell
