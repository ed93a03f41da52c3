// The folds of a sheet, a pack at a time, from all its unknowns.
#pragma once

#include <algorithm>
#include <numbers>

#include "magshell/assembly/lanes.h"
#include "magshell/body/sheet.h"
#include "magshell/strain/dihedral_angle.h"

namespace magshell {

/// Folds [first, last), at most a pack of them. Lanes past the last fold repeat it.
inline DihedralAngle folds_at(const Sheet& sheet, Index first, Index last, const double* q) {
    const FoldStencil* at[Pack::width];
    for (int lane = 0; lane < Pack::width; ++lane) at[lane] = &sheet.folds[std::min(first + lane, last - 1)];
    const auto place = [&](int k) {
        return vectors_of([&](int lane) { return q + 3 * at[lane]->nodes[k]; });
    };
    const auto right_is_point = [&](int lane) { return at[lane]->right_is_point ? 1.0 : 0.0; };
    return DihedralAngle(place(0), place(1), place(2), place(3), pack_of(right_is_point));
}

/// theta - theta~ in (-pi, pi]: a sheet rolled into a closed surface may have its rest angle on the other
/// side of pi.
inline double turn_from(const FoldStencil& fold, double angle) {
    constexpr double pi = std::numbers::pi;
    const double turn = angle - fold.rest_angle;  // of two numbers in [-pi, pi]
    return turn > pi ? turn - 2.0 * pi : turn < -pi ? turn + 2.0 * pi : turn;
}

/// delta of one edge of a face: turn_of(fold) is theta - theta~, or any number a fold that is linear in it.
template <class Turn>
double bending_strain(const FaceSide& side, const Turn& turn_of, const double* rotations) {
    double delta = side.fold < 0 ? 0.0 : side.weight * turn_of(side.fold);
    if (side.rotation >= 0) delta += side.sign * rotations[side.rotation];
    return delta;
}

}  // namespace magshell
