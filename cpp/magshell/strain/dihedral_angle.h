// DihedralAngle: the dihedral angle at an edge of a shell, with its gradient and second derivatives.
//
// An edge e = x1 - x0 and a point r = x2 - x0 beside it span a half-plane. With
//
//   e^ = e/|e|,  n = e x r / |e x r|,  t = n x e^  (in the half-plane, away from the edge),  r = s e + h t,
//
// a rotation of the half-plane about the edge by dα moves r by h dα along n, so its angle α has the derivatives
//
//   dα/dr = n/h,      dα/de = - s n/h
//   d2α/dr2  = - (n t^T + t n^T) / h^2
//   d2α/drde = (s/h^2) (n t^T + t n^T) - e^ n^T / (|e| h)
//   d2α/de2  = - (s^2/h^2 + 1/(2|e|^2)) (n t^T + t n^T) + (s / (|e| h)) (e^ n^T + n e^^T)
//
// up to a rotation about e^ that both half-planes of an edge share; it cancels in their difference, the
// dihedral angle
//
//   theta = α_left - α_right + π,   0 where the shell is flat, positive where the two normals lean towards each other.
//
// The right half-plane contains either a second face (r = x3 - x0) or a direction across the edge (r = x3), which
// is given: at a clamped edge, an edge on a symmetry plane and an edge under a couple.
#pragma once

#include "magshell/core/vector3.h"

namespace magshell {

struct HalfPlane {
    SimdVec3 edge_direction;  // e^, unit vector along the edge
    SimdVec3 normal;          // n
    SimdVec3 away;            // t
    SimdDouble edge_length;   // |e| [m]
    SimdDouble height;        // h, distance of the point from the edge [m]
    SimdDouble foot;          // s, foot of the point on the edge: 0 at x0, 1 at x1

    HalfPlane(const SimdVec3& e, const SimdVec3& r) {
        const SimdDouble e2 = squared_norm(e);
        edge_length = sqrt(e2);
        const SimdVec3 across = cross(e, r);
        const SimdDouble across_length = sqrt(squared_norm(across));
        edge_direction = (SimdDouble(1.0) / edge_length) * e;
        normal = (SimdDouble(1.0) / across_length) * across;
        away = cross(normal, edge_direction);
        height = across_length / edge_length;
        foot = dot(r, e) / e2;
    }

    SimdVec3 by_point() const { return (SimdDouble(1.0) / height) * normal; }
};

/// Computes factor d2α of one half-plane in its variables (r, e); the (e, r) block is the transpose of
/// `point_edge`. The (e, e) block is added, so that those of both half-planes of an edge accumulate.
inline void add_half_plane_hessian(const HalfPlane& w, const SimdDouble& factor, SimdMat3& point_point,
                                   SimdMat3& point_edge, SimdMat3& edge_edge) {
    const SimdDouble inverse_h = SimdDouble(1.0) / w.height;
    const SimdDouble inverse_e = SimdDouble(1.0) / w.edge_length;
    const SimdMat3 rotation = symmetric_outer(w.normal, w.away);
    const SimdMat3 shift = outer(w.edge_direction, w.normal);
    const SimdDouble a = factor * inverse_h * inverse_h, b = w.foot * a, c = factor * inverse_e * inverse_h;
    const SimdDouble d = w.foot * b + SimdDouble(0.5) * factor * inverse_e * inverse_e, f = w.foot * c;
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column) {
            const int k = 3 * row + column, transposed = 3 * column + row;
            point_point.at[k] = -a * rotation.at[k];
            point_edge.at[k] = b * rotation.at[k] - c * shift.at[k];
            edge_edge.at[k] += f * (shift.at[k] + shift.at[transposed]) - d * rotation.at[k];
        }
}

/// The dihedral angle at the edge x0-x1 between the half-planes of x2 (left) and x3 (right).
struct DihedralAngle {
    HalfPlane left, right;
    SimdDouble right_is_point;  // 1: x3 is a point, r = x3 - x0;  0: x3 is a direction, r = x3

    DihedralAngle(const SimdVec3& x0, const SimdVec3& x1, const SimdVec3& x2, const SimdVec3& x3,
                  const SimdDouble& right_is_point_)
        : left(x1 - x0, x2 - x0),
          right(x1 - x0, x3 - right_is_point_ * x0),
          right_is_point(right_is_point_) {}

    /// Returns theta in (-π, π]. The right normal belongs to a face of reversed orientation, hence the minus
    /// sign.
    SimdDouble angle() const {
        const SimdDouble cosine = -dot(left.normal, right.normal);
        const SimdDouble sine = dot(left.normal, right.away);
        return atan2(sine, cosine);
    }

    void gradient(SimdVec3 g[4]) const {
        const SimdVec3 l = left.by_point(), r = -right.by_point();
        const SimdVec3 e = -(left.foot * l) - right.foot * r;
        g[0] = -(e + l + right_is_point * r);
        g[1] = e;
        g[2] = l;
        g[3] = r;
    }
};

/// Computes moment d2theta as 3x3 blocks between the nodes 0 to 3, the lower triangle at row (row + 1) / 2 +
/// column. The block (3, 2) is zero.
struct DihedralHessian {
    enum Block { B00, B10, B11, B20, B21, B22, B30, B31, B32, B33, count };
    SimdMat3 block[count];

    explicit DihedralHessian(const DihedralAngle& dihedral, const SimdDouble& moment) {
        const SimdDouble p = dihedral.right_is_point;
        // theta depends on x1 through e, on x2 through r_left, on x3 through r_right, and on x0 through minus
        // their sum (r_right only if x3 is a point).
        block[B11] = block[B32] = {};
        add_half_plane_hessian(dihedral.left, moment, block[B22], block[B21], block[B11]);
        add_half_plane_hessian(dihedral.right, -moment, block[B33], block[B31], block[B11]);
        // Entry by entry, because whole blocks would be copied through memory.
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 3; ++column) {
                const int k = 3 * row + column, transposed = 3 * column + row;
                block[B20].at[k] = -(block[B21].at[k] + block[B22].at[k]);
                block[B30].at[k] = -(block[B31].at[k] + p * block[B33].at[k]);
                block[B10].at[transposed] = -(block[B11].at[k] + block[B21].at[k] + p * block[B31].at[k]);
            }
        for (int k = 0; k < 9; ++k)
            block[B00].at[k] = -(block[B10].at[k] + block[B20].at[k] + p * block[B30].at[k]);
    }
};

}  // namespace magshell
