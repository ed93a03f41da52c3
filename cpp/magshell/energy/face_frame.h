// FaceFrame: the edge vectors a_1, a_2 of a triangle and its unit normal n, with the derivatives of n by them. One face per SIMD lane.
//
//   N = a_1 x a_2,   n = N / |N|,   P = (b - n (n . b)) / |N|,   [v] w = v x w
//   d(n . b)/da_1 = a_2 x P          d(n . b)/da_2 = - a_1 x P
//   K = (3 (n . b) n n^T - n b^T - b n^T - (n . b) I) / |N|^2
//   H_11 = - [a_2] K [a_2]     H_22 = - [a_1] K [a_1]     H_12 = [a_2] K [a_1] - [P]
//
// for a fixed b. K is the Hessian of n . b by N, and H_ij = d2(n . b)/da_i da_j.
#pragma once

#include "magshell/core/vector3.h"
#include "magshell/energy/symmetric3.h"

namespace magshell {

struct FaceFrame {
    SimdVec3 a1, a2, normal;
    SimdDouble inverse_area2;  // 1 / |N|, where |N| is twice the area

    explicit FaceFrame(const SimdVec3 x[3]) : a1(x[1] - x[0]), a2(x[2] - x[0]) {
        const SimdVec3 across = cross(a1, a2);
        inverse_area2 = SimdDouble(1.0) / sqrt(squared_norm(across));
        normal = inverse_area2 * across;
    }

    /// Returns P = (b - n (n . b)) / |N|.
    SimdVec3 tangential(const SimdVec3& b) const { return inverse_area2 * (b - dot(normal, b) * normal); }

    /// Computes the transposed derivatives of the unit normal by the three nodes, N_k^T.
    void normal_by_nodes(SimdMat3 transposed[3]) const {
        SimdMat3 p = -outer(normal, normal);
        add_to_diagonal(p, SimdDouble(1.0));
        p = inverse_area2 * p;
        transposed[1] = multiply(cross_matrix(a2), p);
        transposed[2] = -multiply(cross_matrix(a1), p);
        transposed[0] = -(transposed[1] + transposed[2]);
    }

    /// Returns the rate of the unit normal for given nodal velocities.
    SimdVec3 normal_rate(const SimdVec3 rate[3]) const {
        return tangential(cross(rate[1] - rate[0], a2) + cross(a1, rate[2] - rate[0]));
    }

    /// Computes the second derivatives of scale n . b by a_1 and a_2.
    void normal_hessian(const SimdDouble& scale, const SimdVec3& b, SimdMat3& h11, SimdMat3& h12,
                        SimdMat3& h22) const {
        const SimdDouble along = dot(normal, b);
        SimdMat3 k = outer((SimdDouble(3.0) * along) * normal, normal) - symmetric_outer(normal, b);
        add_to_diagonal(k, -along);
        k = (scale * inverse_area2 * inverse_area2) * k;
        const SimdMat3 c1 = cross_matrix(a1), c2 = cross_matrix(a2);
        const SimdMat3 kc1 = multiply(k, c1);
        h11 = -multiply(c2, multiply(k, c2)), h22 = -multiply(c1, kc1);
        h12 = multiply(c2, kc1) - scale * cross_matrix(tangential(b));
    }

    /// Computes the lower blocks of the nodes from those of the edge vectors.
    static void node_blocks(const SimdMat3& h11, const SimdMat3& h12, const SimdMat3& h22, SimdMat3 h[6]) {
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 3; ++column) {
                const int k = 3 * row + column, transposed = 3 * column + row;
                const SimdDouble b11 = h11.at[k], b12 = h12.at[k], b21 = h12.at[transposed], b22 = h22.at[k];
                h[lower_index(1, 1)].at[k] = b11;
                h[lower_index(2, 1)].at[k] = b21;
                h[lower_index(2, 2)].at[k] = b22;
                h[lower_index(1, 0)].at[k] = -(b11 + b12);
                h[lower_index(2, 0)].at[k] = -(b21 + b22);
                h[lower_index(0, 0)].at[k] = b11 + b12 + b21 + b22;
            }
    }
};

}  // namespace magshell
