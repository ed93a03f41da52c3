// SixNodeRows: the derivatives J of nine strain measures by the six nodes of a quadratic triangle, and their
// products with a stiffness C.
#pragma once

#include "magshell/energy/symmetric3.h"

namespace magshell {

using Symmetric9 = Symmetric<9>;

struct SixNodeRows {
    SimdVec3 at[9][6];

    /// Returns C J.
    SixNodeRows times(const Symmetric9& stiffness) const {
        SixNodeRows product;
        for (int r = 0; r < 9; ++r)
            for (int a = 0; a < 6; ++a) {
                SimdVec3 sum = stiffness(r, 0) * at[0][a];
                for (int s = 1; s < 9; ++s) sum += stiffness(r, s) * at[s][a];
                product.at[r][a] = sum;
            }
        return product;
    }

    /// Computes the lower blocks (a, b) of J^T S with S = C J, at lower_index(a, b).
    void blocks(const SixNodeRows& stiff, SimdMat3 h[21]) const {
        for (int a = 0; a < 6; ++a)
            for (int b = 0; b <= a; ++b) {
                SimdMat3 sum = outer(at[0][a], stiff.at[0][b]);
                for (int r = 1; r < 9; ++r) sum += outer(at[r][a], stiff.at[r][b]);
                h[lower_index(a, b)] = sum;
            }
    }

    /// Computes the forces J^T s.
    void forces(const SimdDouble stress[9], SimdVec3 g[6]) const {
        for (int a = 0; a < 6; ++a) {
            g[a] = stress[0] * at[0][a];
            for (int r = 1; r < 9; ++r) g[a] += stress[r] * at[r][a];
        }
    }

    /// Computes the strain rates J p.
    void along(const SimdVec3 p[6], SimdDouble rate[9]) const {
        for (int r = 0; r < 9; ++r) {
            rate[r] = dot(at[r][0], p[0]);
            for (int a = 1; a < 6; ++a) rate[r] += dot(at[r][a], p[a]);
        }
    }
};

}  // namespace magshell
