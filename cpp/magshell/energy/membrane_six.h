// MembraneSix: the membrane strain measures of a quadratic triangle: squared derivatives along its edges,
// |dx/dt_i|^2, at the two Gauss points of each edge, and their mean over the face. energy/six_node_face.h
#pragma once

#include <algorithm>

#include "magshell/energy/six_node_rows.h"
#include "magshell/strain/relative_to_first_node.h"
#include "magshell/strain/six_nodes.h"

namespace magshell {

/// Each measure d[3 i + k] is a sum of weight |sum_a by_node[a] x_a|^2: one summand for a Gauss point, three
/// for the mean.
class MembraneSix {
  public:
    explicit MembraneSix(const SimdVec3 places[6]) {
        const std::array<SimdVec3, 6> x = relative_to_first_node<6>(places);
        for (int i = 0; i < 3; ++i) {
            for (int g = 0; g < 2; ++g) {
                each_along(i, g, [&](int a, double c) { add(on_edge_[i][g], c, x[a]); });
            }
            for (int m = 0; m < 3; ++m)
                for (int a = 0; a < 6; ++a)
                    if (const double c = of_middle(i, m)[a]; c != 0.0) add(at_middle_[i][m], c, x[a]);
        }
    }

    /// Computes the measures; the caller subtracts their reference values.
    void measures(SimdDouble d[9]) const {
        for (int i = 0; i < 3; ++i) {
            for (int g = 0; g < 2; ++g) d[3 * i + g] = squared_norm(on_edge_[i][g]);
            d[3 * i + 2] =
                SimdDouble(1.0 / 3.0) * (squared_norm(at_middle_[i][0]) + squared_norm(at_middle_[i][1]) +
                                         squared_norm(at_middle_[i][2]));
        }
    }

    void rows(SixNodeRows& out) const {
        for (int i = 0; i < 3; ++i) {
            for (int g = 0; g < 2; ++g) {
                for (SimdVec3& by_node : out.at[3 * i + g])
                    by_node = {SimdDouble(0.0), SimdDouble(0.0), SimdDouble(0.0)};
                each_along(i, g, [&](int a, double c) {
                    out.at[3 * i + g][a] = SimdDouble(2.0 * c) * on_edge_[i][g];
                });
            }
            for (int a = 0; a < 6; ++a) {
                SimdVec3& by_node = out.at[3 * i + 2][a];
                by_node = {SimdDouble(0.0), SimdDouble(0.0), SimdDouble(0.0)};
                for (int m = 0; m < 3; ++m) add(by_node, 2.0 / 3.0 * of_middle(i, m)[a], at_middle_[i][m]);
            }
        }
    }

    /// Adds sum_r stress_r d2d_r.
    static void add_curvature(const SimdDouble stress[9], SimdMat3 h[21]) {
        for (int i = 0; i < 3; ++i) {
            const int nodes[3] = {(i + 1) % 3, (i + 2) % 3, six_nodes::middle(i)};
            for (int g = 0; g < 2; ++g) {
                const std::array<double, 3> c = six_nodes::along(six_nodes::gauss[g]);
                for (int p = 0; p < 3; ++p)
                    for (int q = 0; q <= p; ++q)
                        add_to_diagonal(
                            h[lower_index(std::max(nodes[p], nodes[q]), std::min(nodes[p], nodes[q]))],
                            SimdDouble(2.0 * c[p] * c[q]) * stress[3 * i + g]);
            }
            for (int a = 0; a < 6; ++a)
                for (int b = 0; b <= a; ++b) {
                    double sum = 0.0;
                    for (int m = 0; m < 3; ++m) sum += of_middle(i, m)[a] * of_middle(i, m)[b];
                    add_to_diagonal(h[lower_index(a, b)], SimdDouble(2.0 / 3.0 * sum) * stress[3 * i + 2]);
                }
        }
    }

  private:
    static void add(SimdVec3& to, double factor, const SimdVec3& x) { to += SimdDouble(factor) * x; }

    /// Calls take(node, coefficient) for the derivative along edge i at its Gauss point g.
    template <class Take>
    static void each_along(int i, int g, const Take& take) {
        const std::array<double, 3> c = six_nodes::along(six_nodes::gauss[g]);
        take((i + 1) % 3, c[0]);
        take((i + 2) % 3, c[1]);
        take(six_nodes::middle(i), c[2]);
    }

    /// Returns the coefficients of the nodes in the derivative along t_i at the middle of edge m.
    static constexpr const std::array<double, 6>& of_middle(int i, int m) { return middles_[3 * i + m]; }
    static constexpr std::array<std::array<double, 6>, 9> middles_ = [] {
        std::array<std::array<double, 6>, 9> all{};
        for (int i = 0; i < 3; ++i)
            for (int m = 0; m < 3; ++m) {
                std::array<double, 3> at = {0.5, 0.5, 0.5};
                at[m] = 0.0;
                all[3 * i + m] = six_nodes::derivative(i, at);
            }
        return all;
    }();

    SimdVec3 on_edge_[3][2] = {}, at_middle_[3][3] = {};
};

}  // namespace magshell
