// The folds of a sheet, a pack at a time, from all its unknowns.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "magshell/assembly/lanes.h"
#include "magshell/body/sheet.h"
#include "magshell/strain/fold_angle.h"

namespace magshell {

/// Folds [first, last), at most a pack of them. Lanes past the last fold repeat it.
inline Fold folds_at(const Sheet& sheet, Index first, Index last, const double* q) {
    Pack3 x[4];
    Pack right_is_point;
    for (int lane = 0; lane < Pack::width; ++lane) {
        const FoldStencil& fold = sheet.folds[std::min(first + lane, last - 1)];
        for (int k = 0; k < 4; ++k) set_lane(x[k], lane, q + 3 * fold.nodes[k]);
        right_is_point.set(lane, fold.right_is_point ? 1.0 : 0.0);
    }
    return Fold(x[0], x[1], x[2], x[3], right_is_point);
}

/// theta - theta~ in (-pi, pi]: a sheet rolled into a closed surface may have its rest angle on the other
/// side of pi.
inline double turn_from(const FoldStencil& fold, double angle) {
    return std::remainder(angle - fold.rest_angle, 2.0 * std::numbers::pi);
}

/// delta of one edge of a face: turn_of(fold) is theta - theta~, or any number a fold that is linear in it.
template <class Turn>
double bending_strain(const FaceSide& side, const Turn& turn_of, const double* rotations) {
    double delta = side.fold < 0 ? 0.0 : side.weight * turn_of(side.fold);
    if (side.rotation >= 0) delta += side.sign * rotations[side.rotation];
    return delta;
}

}  // namespace magshell
