// Dihedral angles between the faces of a shell, a SIMD vector at a time, from all dofs.
#pragma once

#include <algorithm>
#include <numbers>

#include "magshell/assembly/lanes.h"
#include "magshell/body/shell.h"
#include "magshell/strain/dihedral_angle.h"

namespace magshell {

/// Returns the dihedral angles [first, last), at most a SIMD vector of them. Lanes past the last one repeat it.
inline DihedralAngle dihedral_angles_at(const Shell& shell, Index first, Index last, const double* q) {
    const DihedralStencil* at[SimdDouble::width];
    for (int lane = 0; lane < SimdDouble::width; ++lane)
        at[lane] = &shell.dihedrals[std::min(first + lane, last - 1)];
    const auto place = [&](int k) {
        return vectors_of([&](int lane) { return q + 3 * at[lane]->nodes[k]; });
    };
    const auto right_is_point = [&](int lane) { return at[lane]->right_is_point ? 1.0 : 0.0; };
    return DihedralAngle(place(0), place(1), place(2), place(3), simd_of(right_is_point));
}

/// Returns the change of an angle since rest, theta - theta~, in (-pi, pi]. Without this wrap, the rest angle of a shell rolled into a closed
/// surface might be on the other side of pi.
inline double angle_change(const DihedralStencil& dihedral, double angle) {
    constexpr double pi = std::numbers::pi;
    const double turn = angle - dihedral.rest_angle;  // both angles are in [-pi, pi]
    return turn > pi ? turn - 2.0 * pi : turn < -pi ? turn + 2.0 * pi : turn;
}

/// Returns the bending strain delta of one edge of a face; change_of(dihedral) returns theta - theta~, or any quantity that delta is linear in.
template <class Change>
double bending_strain(const FaceSide& side, const Change& change_of, const double* rotations) {
    double delta = side.dihedral < 0 ? 0.0 : side.weight * change_of(side.dihedral);
    if (side.rotation >= 0) delta += side.sign * rotations[side.rotation];
    return delta;
}

}  // namespace magshell
