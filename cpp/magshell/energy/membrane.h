// Membrane: the membrane energy of a St. Venant-Kirchhoff shell of linear triangles in plane stress.
//
//   E_f = 1/2 s^T C s,   s_i = |a_i|^2 - |a~_i|^2                                   [J]   [Chen22] (18), (22)
//
// a_i is the edge opposite vertex i. One face per SIMD lane.
#pragma once

#include <string_view>

#include "magshell/core/vector3.h"
#include "magshell/energy/symmetric3.h"

namespace magshell {

struct Membrane {
    static constexpr std::string_view name = "membrane";
    static constexpr int stresses = 3;

    struct Element {
        SimdDouble rest_squared_length[3];
        Symmetric3 stiffness;
    };

    SimdVec3 edge[3];

    explicit Membrane(const SimdVec3 x[3]) : edge{x[2] - x[1], x[0] - x[2], x[1] - x[0]} {}

    void strain(const Element& element, SimdDouble s[3]) const {
        for (int i = 0; i < 3; ++i) s[i] = squared_norm(edge[i]) - element.rest_squared_length[i];
    }

    void strain_rate(const SimdVec3 p[3], SimdDouble rate[3]) const {
        const SimdVec3 turn[3] = {p[2] - p[1], p[0] - p[2], p[1] - p[0]};
        for (int i = 0; i < 3; ++i) rate[i] = SimdDouble(2.0) * dot(edge[i], turn[i]);
    }

    void gradient(const SimdDouble stress[3], SimdVec3 g[3]) const {
        SimdVec3 pull[3];
        for (int i = 0; i < 3; ++i) pull[i] = (SimdDouble(2.0) * stress[i]) * edge[i];
        for (int k = 0; k < 3; ++k) g[k] = pull[(k + 1) % 3] - pull[(k + 2) % 3];
    }

    /// Computes the lower blocks (k, l) of J^T C J + sum_i sigma_i d2s_i at lower_index(k, l).
    void hessian(const Symmetric3& stiffness, const SimdDouble stress[3], SimdMat3 h[6]) const {
        // Node k enters edge k+1 with + and edge k+2 with -; pair[i][j] = d2E/da_i da_j.
        SimdMat3 pair[3][3];
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j <= i; ++j) {
                pair[i][j] = outer((SimdDouble(4.0) * stiffness(i, j)) * edge[i], edge[j]);
                if (i == j)
                    add_to_diagonal(pair[i][i], SimdDouble(2.0) * stress[i]);
                else
                    pair[j][i] = transpose(pair[i][j]);
            }
        for (int k = 0; k < 3; ++k)
            for (int l = 0; l <= k; ++l) {
                const int kp = (k + 1) % 3, km = (k + 2) % 3, lp = (l + 1) % 3, lm = (l + 2) % 3;
                h[lower_index(k, l)] = pair[kp][lp] - pair[kp][lm] - pair[km][lp] + pair[km][lm];
            }
    }
};

}  // namespace magshell
