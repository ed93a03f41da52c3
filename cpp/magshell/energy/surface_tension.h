// SurfaceTension: the surface energy of a linear triangle.
//
//   E_f = gamma A(x),   A = |a_1 x a_2| / 2                                         [J]
//
// with a_1 = x_1 - x_0, a_2 = x_2 - x_0 and the unit normal n,
//
//   dA = (a_2 x n) . da_1 / 2 + (n x a_1) . da_2 / 2,   dn = (I - n n^T) (da_1 x a_2 + a_1 x da_2) / |a_1 x a_2|.
//
// One face per SIMD lane.
#pragma once

#include <string_view>

#include "magshell/core/parameters.h"
#include "magshell/core/vector3.h"
#include "magshell/energy/symmetric3.h"

namespace magshell {

struct SurfaceTension {
    static constexpr std::string_view name = "surface tension";
    static constexpr FaceInput inputs[] = {{"surface_tension", "N/m"}};

    SimdVec3 a1, a2, normal;
    SimdDouble area2;  // |a_1 x a_2|

    explicit SurfaceTension(const SimdVec3 x[3]) : a1(x[1] - x[0]), a2(x[2] - x[0]) {
        const SimdVec3 across = cross(a1, a2);
        area2 = sqrt(squared_norm(across));
        normal = (SimdDouble(1.0) / area2) * across;
    }

    SimdDouble energy(const SimdDouble in[1]) const { return SimdDouble(0.5) * in[0] * area2; }

    void gradient(const SimdDouble in[1], SimdVec3 g[3]) const {
        const SimdDouble half = SimdDouble(0.5) * in[0];
        g[1] = half * cross(a2, normal);
        g[2] = half * cross(normal, a1);
        g[0] = -(g[1] + g[2]);
    }

    /// Computes the lower blocks at lower_index(k, l).
    void hessian(const SimdDouble in[1], SimdMat3 h[6]) const {
        const SimdDouble half = SimdDouble(0.5) * in[0];
        SimdMat3 k = SimdDouble(-1.0) * outer(normal, normal);
        add_to_diagonal(k, SimdDouble(1.0));
        k = (half / area2) * k;
        const SimdMat3 c1 = cross_matrix(a1), c2 = cross_matrix(a2), kc1 = multiply(k, c1);
        const SimdMat3 h11 = -multiply(c2, multiply(k, c2)), h22 = -multiply(c1, kc1);
        const SimdMat3 h12 = multiply(c2, kc1) - half * cross_matrix(normal), h21 = transpose(h12);
        h[lower_index(1, 1)] = h11;
        h[lower_index(2, 1)] = h21;
        h[lower_index(2, 2)] = h22;
        h[lower_index(1, 0)] = -(h11 + h12);
        h[lower_index(2, 0)] = -(h21 + h22);
        h[lower_index(0, 0)] = h11 + h12 + h21 + h22;
    }

    /// Computes d(rate . gradient)/d(input) for each input.
    void rate_by_inputs(const SimdDouble[1], const SimdVec3 rate[3], SimdDouble out[1]) const {
        out[0] = SimdDouble(0.5) *
                 (dot(rate[1] - rate[0], cross(a2, normal)) + dot(rate[2] - rate[0], cross(normal, a1)));
    }
};

}  // namespace magshell
