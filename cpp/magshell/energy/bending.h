// Bending energy of a St. Venant-Kirchhoff shell of linear triangles.
//
//   E_f = 1/2 delta^T C delta                                                       [J]   [Chen22] (19), (23)
//
// delta_i is the change of the angle between the face's normal and the director at the midpoint of its edge i,
//
//   delta_i = c_i (theta_i - theta~_i) + s_i phi_i
//
// with the dihedral angle theta of the edge, the rotation phi of its director, c = 1/2 between two faces and 1
// at a clamped edge, and s = +1 and -1 on the two sides. `hinge` bending has no phi; a free edge has no theta.
// One face per SIMD lane.
#pragma once

#include <string_view>

#include "magshell/core/vector3.h"
#include "magshell/energy/symmetric3.h"

namespace magshell {

/// The J^T C J part of a face's Hessian. The second derivatives of theta are added per edge.
struct BendingFace {
    // d delta_i / d(node): `corner[i][k]` for the face's own vertex k, `beyond[i]` for the vertex across edge
    // i.
    SimdVec3 corner[3][3];
    SimdVec3 beyond[3];
    SimdDouble sign[3];  // d delta_i / d phi_i

    /// Computes the blocks between the six nodes (corners 0-2, vertices across the edges 3-5) at
    /// lower_index(row, column).
    void node_blocks(const Symmetric3& stiffness, SimdMat3 h[21], SimdVec3 stiff_corner[3][3]) const {
        for (int j = 0; j < 3; ++j)
            for (int k = 0; k < 3; ++k)
                stiff_corner[j][k] = stiffness(j, 0) * corner[0][k] + stiffness(j, 1) * corner[1][k] +
                                     stiffness(j, 2) * corner[2][k];
        for (int k = 0; k < 3; ++k)
            for (int l = 0; l <= k; ++l) {
                SimdMat3& block = h[lower_index(k, l)];
                block = outer(corner[0][k], stiff_corner[0][l]);
                block += outer(corner[1][k], stiff_corner[1][l]);
                block += outer(corner[2][k], stiff_corner[2][l]);
            }
        for (int i = 0; i < 3; ++i) {
            for (int l = 0; l < 3; ++l) h[lower_index(3 + i, l)] = outer(beyond[i], stiff_corner[i][l]);
            for (int j = 0; j <= i; ++j)
                h[lower_index(3 + i, 3 + j)] = outer(stiffness(i, j) * beyond[i], beyond[j]);
        }
    }

    /// Computes the rows of phi_i against the six nodes: rows[i][node].
    void rotation_rows(const Symmetric3& stiffness, const SimdVec3 stiff_corner[3][3],
                       SimdVec3 rows[3][6]) const {
        for (int i = 0; i < 3; ++i)
            for (int k = 0; k < 3; ++k) {
                rows[i][k] = sign[i] * stiff_corner[i][k];
                rows[i][3 + k] = (sign[i] * stiffness(i, k)) * beyond[k];
            }
    }
};

}  // namespace magshell
