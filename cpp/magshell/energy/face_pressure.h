// Forces of a pressure on a curved face, exactly: a pressure p pushes against the normals, f = - p n da, and with the
// face's shape functions N_k over its parameters (s, t)
//
//   g_k = - f_k = p int N_k (x_s x x_t) ds dt = p sum_{l<m} A_klm x_l x x_m                                    [N]
//   A_klm = int N_k (N_l,s N_m,t - N_m,s N_l,t) ds dt
//
// where A is the same for all faces, and no point of integration is left. With c_kl = sum_m A_klm x_m
//
//   dg_k/dx_l = - p [c_kl]x,    symmetric part - p/2 [c_kl - c_lk]x,    skew part - p/2 [c_kl + c_lk]x.
//
// Summed up over the faces of a surface the skew part is - 1/2 of the line integral of p v . (u x dx) around its border:
// it vanishes where the surface is closed or its border held, and p is the same everywhere. There p times the volume
// enclosed is a potential, elsewhere there is none.
//
// A face of six nodes (corners, then the middles 01, 12, 20) is shown to callers as four flat triangles, each of which may
// have a pressure of its own: A is known for each of these parts.
#pragma once

#include <array>

#include "magshell/core/types.h"

namespace magshell {

template <int N>
struct FacePressure {
    static_assert(N == 3 || N == 6);
    static constexpr int parts = N == 3 ? 1 : 4;
    static constexpr int pairs = N * (N - 1) / 2;
    /// A_klm of a part, or a sum of them times pressures: rows k; columns the pairs l < m, row after row.
    using Coefficients = std::array<std::array<double, pairs>, N>;
    using Corners = std::array<Vec3, N>;

    static const std::array<Coefficients, parts>& of_parts();

    /// Where nothing but shape and size count: coordinates from the first node on.
    static Corners relative(const Corners& x) {
        Corners y;
        for (int k = 0; k < N; ++k) y[k] = x[k] - x[0];
        return y;
    }

    /// g_k at coordinates from the first node on.
    static Corners forces(const Coefficients& a, const Corners& y) {
        Corners g;
        g.fill(Vec3::Zero());
        for (int l = 1, pair = N - 1; l < N; ++l)  // the pairs with the first node have no share
            for (int m = l + 1; m < N; ++m, ++pair) {
                const Vec3 across = y[l].cross(y[m]);
                for (int k = 0; k < N; ++k) g[k] += a[k][pair] * across;
            }
        return g;
    }

    /// c_kl, likewise.
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
