// Deformation gradient F of a point of a solid, its determinant J, and their derivatives. One point per SIMD
// lane.
//
//   F = sum_k x_k (x) g_k,   g_k the gradient of node k's shape function in the reference configuration [1/m]
//   J = det F,   dJ/dx_k = cof F g_k,   d2J/dx_k dx_l = -[F (g_k x g_l)]
//
// Nothing here divides by J, so all of it holds for flat and inverted elements.
#pragma once

#include "magshell/core/vector3.h"

namespace magshell {

/// Returns a v; `a` is stored row by row.
inline SimdVec3 multiply(const SimdMat3& a, const SimdVec3& v) {
    return {a.at[0] * v.x + a.at[1] * v.y + a.at[2] * v.z, a.at[3] * v.x + a.at[4] * v.y + a.at[5] * v.z,
            a.at[6] * v.x + a.at[7] * v.y + a.at[8] * v.z};
}

inline SimdMat3 transposed_times(const SimdMat3& a, const SimdMat3& b) {
    SimdMat3 product;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
            product.at[3 * r + c] = a.at[r] * b.at[c] + a.at[3 + r] * b.at[3 + c] + a.at[6 + r] * b.at[6 + c];
    return product;
}

inline SimdDouble double_dot(const SimdMat3& a, const SimdMat3& b) {
    SimdDouble sum = a.at[0] * b.at[0];
    for (int k = 1; k < 9; ++k) sum += a.at[k] * b.at[k];
    return sum;
}

/// Returns sum_k x_k (x) g_k. The gradients g_k add up to zero, so positions are taken relative to the first
/// node.
template <int N>
inline SimdMat3 deformation_gradient(const SimdVec3 x[N], const SimdVec3 g[N]) {
    SimdMat3 f = outer(x[1] - x[0], g[1]);
    for (int k = 2; k < N; ++k) f += outer(x[k] - x[0], g[k]);
    return f;
}

/// Returns cof F = J F^-T.
inline SimdMat3 cofactor(const SimdMat3& f) {
    const SimdDouble* a = f.at;
    return {{a[4] * a[8] - a[5] * a[7], a[5] * a[6] - a[3] * a[8], a[3] * a[7] - a[4] * a[6],
             a[2] * a[7] - a[1] * a[8], a[0] * a[8] - a[2] * a[6], a[1] * a[6] - a[0] * a[7],
             a[1] * a[5] - a[2] * a[4], a[2] * a[3] - a[0] * a[5], a[0] * a[4] - a[1] * a[3]}};
}

inline SimdDouble determinant(const SimdMat3& f, const SimdMat3& cofactors) {
    return f.at[0] * cofactors.at[0] + f.at[1] * cofactors.at[1] + f.at[2] * cofactors.at[2];
}

/// Computes the coefficients of det(F + t D) = c[0] + c[1] t + c[2] t^2 + c[3] t^3.
inline void determinant_along(const SimdMat3& f, const SimdMat3& d, SimdDouble c[4]) {
    const SimdMat3 cof_f = cofactor(f), cof_d = cofactor(d);
    c[0] = determinant(f, cof_f);
    c[1] = double_dot(cof_f, d);
    c[2] = double_dot(cof_d, f);
    c[3] = determinant(d, cof_d);
}

}  // namespace magshell
