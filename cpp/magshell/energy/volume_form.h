// VolumeForm: the signed volume between a curved face and the origin. With A of energy/face_pressure.h,
//
//   V = 1/3 sum_k x_k . (sum_{l<m} A_klm x_l x x_m) = sum_{k<l<m} B_klm det(x_k, x_l, x_m)                        [m3]
//   B_klm = (A_klm - A_lkm + A_mkl) / 3                                             1/6 for three nodes
//
// Summed over a closed surface with outward normals it is the enclosed volume, wherever the origin is. It is a
// function of the positions only, so its second derivatives are symmetric for every surface; the block between
// nodes k and l is [c]x with c a sum of B_klm x_m.
#pragma once

#include <array>

#include "magshell/energy/face_pressure.h"

namespace magshell {

template <int N>
struct VolumeForm {
    static constexpr int triples = N * (N - 1) * (N - 2) / 6;
    using Corners = std::array<Vec3, N>;

    /// Returns B for the triples k < l < m, in that order.
    static const std::array<double, triples>& coefficients() {
        static const std::array<double, triples> known = [] {
            std::array<double, triples> b{};
            each_triple([&](int triple, int k, int l, int m) {
                for (const auto& a : FacePressure<N>::of_parts())
                    b[triple] += (a[k][pair(l, m)] - a[l][pair(k, m)] + a[m][pair(k, l)]) / 3.0;
            });
            return b;
        }();
        return known;
    }

    static double volume(const Corners& x) {
        double sum = 0.0;
        each_triple([&](int triple, int k, int l, int m) {
            sum += coefficients()[triple] * x[k].dot(x[l].cross(x[m]));
        });
        return sum;
    }

    /// Returns dV/dx_k.
    static Corners slopes(const Corners& x) {
        Corners g;
        g.fill(Vec3::Zero());
        each_triple([&](int triple, int k, int l, int m) {
            const double b = coefficients()[triple];
            g[k] += b * x[l].cross(x[m]);
            g[l] += b * x[m].cross(x[k]);
            g[m] += b * x[k].cross(x[l]);
        });
        return g;
    }

    /// Calls visit(row, column, axis) for contributions to the blocks below the diagonal, d2V/dx_row dx_column
    /// = [axis]x.
    template <class Visit>
    static void curvature(const Corners& x, const Visit& visit) {
        each_triple([&](int triple, int k, int l, int m) {
            const double b = coefficients()[triple];
            visit(l, k, Vec3(b * x[m]));
            visit(m, k, Vec3(-b * x[l]));
            visit(m, l, Vec3(b * x[k]));
        });
    }

  private:
    static constexpr int pair(int l, int m) { return l * (2 * N - l - 1) / 2 + m - l - 1; }

    template <class Visit>
    static void each_triple(const Visit& visit) {
        int triple = 0;
        for (int k = 0; k < N; ++k)
            for (int l = k + 1; l < N; ++l)
                for (int m = l + 1; m < N; ++m) visit(triple++, k, l, m);
    }
};

}  // namespace magshell
