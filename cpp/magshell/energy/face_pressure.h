// FacePressure: nodal forces of a uniform pressure on a curved face, integrated exactly. The pressure acts
// against the normals, f = - p n da. With the face's shape functions N_k of its parameters (s, t)
//
//   g_k = - f_k = p int N_k (x_s x x_t) ds dt = p sum_{l<m} A_klm x_l x x_m                                    [N]
//   A_klm = int N_k (N_l,s N_m,t - N_m,s N_l,t) ds dt
//
// A is the same for all faces, so no integration points remain. With c_kl = sum_m A_klm x_m
//
//   dg_k/dx_l = - p [c_kl]x,    symmetric part - p/2 [c_kl - c_lk]x,    skew part - p/2 [c_kl + c_lk]x.
//
// Summed over the faces of a surface, the skew part equals - 1/2 of the line integral of p v . (u x dx) around
// its border. It vanishes if the surface is closed or its border fixed, and p is uniform; then p times the
// enclosed volume is a potential. Otherwise there is none.
//
// Callers see a face of six nodes (corners, then the middles 01, 12, 20) as four flat triangles, each of which
// may have its own pressure. A is therefore stored for each of these parts.
#pragma once

#include <array>

#include "magshell/core/types.h"

namespace magshell {

template <int N>
struct FacePressure {
    static_assert(N == 3 || N == 6);
    static constexpr int parts = N == 3 ? 1 : 4;
    static constexpr int pairs = N * (N - 1) / 2;
    /// A_klm of a part, or a sum of them times pressures: k by rows, the pairs l < m by columns, row after row.
    using Coefficients = std::array<std::array<double, pairs>, N>;
    using Corners = std::array<Vec3, N>;

    static const std::array<Coefficients, parts>& of_parts();

    /// Returns the positions relative to the first node.
    static Corners relative(const Corners& x) {
        Corners y;
        for (int k = 0; k < N; ++k) y[k] = x[k] - x[0];
        return y;
    }

    /// Returns g_k / p for positions relative to the first node.
    static Corners forces(const Coefficients& a, const Corners& y) {
        Corners g;
        g.fill(Vec3::Zero());
        for (int l = 1, pair = N - 1; l < N; ++l)  // pairs with the first node contribute nothing
            for (int m = l + 1; m < N; ++m, ++pair) {
                const Vec3 across = y[l].cross(y[m]);
                for (int k = 0; k < N; ++k) g[k] += a[k][pair] * across;
            }
        return g;
    }

    /// Returns c_kl for positions relative to the first node.
    static std::array<Corners, N> axes(const Coefficients& a, const Corners& y) {
        std::array<Corners, N> c;
        for (int k = 0; k < N; ++k) {
            c[k].fill(Vec3::Zero());
            for (int l = 0, pair = 0; l < N; ++l)
                for (int m = l + 1; m < N; ++m, ++pair) {
                    c[k][l] += a[k][pair] * y[m];
                    c[k][m] -= a[k][pair] * y[l];
                }
        }
        return c;
    }
};

extern template struct FacePressure<3>;
extern template struct FacePressure<6>;

}  // namespace magshell
