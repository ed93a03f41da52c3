// Shape functions of tetrahedra at their points of integration, as strain/tetrahedron.h has their gradients.
#pragma once

#include <array>

#include "magshell/strain/tetrahedron.h"

namespace magshell {

/// Of straight elements: at the middle. `point` is the only one.
inline std::array<double, 4> shapes_at(LinearTetrahedron, int /*point*/) {
    return {0.25, 0.25, 0.25, 0.25};
}

inline std::array<double, 10> shapes_at(QuadraticTetrahedron, int point) {
    std::array<double, 10> shapes;
    const auto at = [&](int corner) { return QuadraticTetrahedron::barycentric(point, corner); };
    for (int i = 0; i < 4; ++i) shapes[i] = at(i) * (2.0 * at(i) - 1.0);
    for (int m = 0; m < 6; ++m) shapes[4 + m] = 4.0 * at(middle_of[m][0]) * at(middle_of[m][1]);
    return shapes;
}

}  // namespace magshell
