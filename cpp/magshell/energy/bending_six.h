// BendingSix: the curvature inside a quadratic triangle, tested with the moments of its bending element: the
// part of the nine bending strains that depends on the face's own nodes. energy/six_node_face.h
//
//   f[3 i + k] = scale sum_p w_p/2 psi_ik(p) / J~(p)  c_i . n(p),     c_i = 4 (x_i + m_i - m_{i+1} - m_{i+2})
//
// with m_i the middle node opposite corner i. c_i is minus the mixed second derivative along the two other
// edges, a constant of the face. For given stresses the energy at a point is b . n(a_1, a_2), linear in b =
// sum_a e_a x_a: its derivatives are those of a unit normal, mapped to the nodes.
#pragma once

#include "magshell/energy/six_node_rows.h"
#include "magshell/strain/relative_to_first_node.h"
#include "magshell/strain/six_nodes.h"

namespace magshell {

class BendingSix {
  public:
    static constexpr int points = 6;

    struct Element {
        SimdDouble inverse_jacobian[points];
        SimdDouble scale[9];
    };

    explicit BendingSix(const SimdVec3 places[6]) {
        const std::array<SimdVec3, 6> x = relative_to_first_node<6>(places);
        for (int p = 0; p < points; ++p) {
            Normal& at = at_[p];
            at.a1 = combination(first(p), x.data());
            at.a2 = combination(second(p), x.data());
            const SimdVec3 across = cross(at.a1, at.a2);
            at.inverse_area = SimdDouble(1.0) / sqrt(squared_norm(across));
            at.n = at.inverse_area * across;
        }
        for (int i = 0; i < 3; ++i)
            bend_[i] = SimdDouble(4.0) * (x[i] + x[six_nodes::middle(i)] - x[six_nodes::middle((i + 1) % 3)] -
                                          x[six_nodes::middle((i + 2) % 3)]);
    }

    /// Computes the measures f; the caller subtracts their reference values.
    void measures(const Element& element, SimdDouble f[9]) const {
        for (int r = 0; r < 9; ++r) f[r] = SimdDouble(0.0);
        for (int i = 0; i < 3; ++i)
            for (int p = 0; p < points; ++p) {
                const SimdDouble bent = element.inverse_jacobian[p] * dot(bend_[i], at_[p].n);
                for (int k = 0; k < 3; ++k) f[3 * i + k] += SimdDouble(weight(i, k, p)) * bent;
            }
        for (int r = 0; r < 9; ++r) f[r] *= element.scale[r];
    }

    void rows(const Element& element, SixNodeRows& out) const {
        for (auto& row : out.at)
            for (SimdVec3& by_node : row) by_node = {SimdDouble(0.0), SimdDouble(0.0), SimdDouble(0.0)};
        for (int i = 0; i < 3; ++i) {
            SimdVec3 normal[3] = {};  // integral of n times each of the three test functions
            for (int p = 0; p < points; ++p) {
                SimdVec3 by_first, by_second;
                at_[p].derivatives(bend_[i], by_first, by_second);
                const SimdVec3 n = element.inverse_jacobian[p] * at_[p].n;
                by_first = element.inverse_jacobian[p] * by_first;
                by_second = element.inverse_jacobian[p] * by_second;
                for (int k = 0; k < 3; ++k) normal[k] += SimdDouble(weight(i, k, p)) * n;
                for (int a = 0; a < 6; ++a) {
                    const SimdVec3 by_node =
                        SimdDouble(first(p)[a]) * by_first + SimdDouble(second(p)[a]) * by_second;
                    for (int k = 0; k < 3; ++k) out.at[3 * i + k][a] += SimdDouble(weight(i, k, p)) * by_node;
                }
            }
            for (int k = 0; k < 3; ++k)
                for (const auto& [node, factor] : bend_of(i))
                    out.at[3 * i + k][node] += SimdDouble(factor) * normal[k];
        }
        for (int r = 0; r < 9; ++r)
            for (SimdVec3& by_node : out.at[r]) by_node = element.scale[r] * by_node;
    }

    /// Adds sum_r stress_r d2f_r.
    void add_curvature(const Element& element, const SimdDouble stress[9], SimdMat3 h[21]) const {
        SimdDouble scaled[9];
        for (int r = 0; r < 9; ++r) scaled[r] = element.scale[r] * stress[r];
        for (int p = 0; p < points; ++p) {
            SimdDouble share[3];
            SimdVec3 b = {SimdDouble(0.0), SimdDouble(0.0), SimdDouble(0.0)};
            SimdDouble e[6] = {};
            for (int i = 0; i < 3; ++i) {
                share[i] = SimdDouble(weight(i, 0, p)) * scaled[3 * i];
                for (int k = 1; k < 3; ++k) share[i] += SimdDouble(weight(i, k, p)) * scaled[3 * i + k];
                share[i] *= element.inverse_jacobian[p];
                b += share[i] * bend_[i];
                for (const auto& [node, factor] : bend_of(i)) e[node] += SimdDouble(factor) * share[i];
            }
            const NormalCurvature c(at_[p], b);
            for (int column = 0; column < 6; ++column) {
                const SimdDouble g1(first(p)[column]), g2(second(p)[column]);
                const SimdMat3 by_first =
                    g1 * c.first_first + g2 * c.first_second + e[column] * transpose(c.b_first);
                const SimdMat3 by_second =
                    g1 * transpose(c.first_second) + g2 * c.second_second + e[column] * transpose(c.b_second);
                const SimdMat3 by_b = g1 * c.b_first + g2 * c.b_second;
                for (int row = column; row < 6; ++row) {
                    SimdMat3& into = h[lower_index(row, column)];
                    into += SimdDouble(first(p)[row]) * by_first;
                    into += SimdDouble(second(p)[row]) * by_second;
                    into += e[row] * by_b;
                }
            }
        }
    }

  private:
    struct Normal {
        SimdVec3 a1, a2, n;
        SimdDouble inverse_area;

        /// Computes the derivatives of b . n by a1 and a2.
        void derivatives(const SimdVec3& b, SimdVec3& by_first, SimdVec3& by_second) const {
            const SimdVec3 across = inverse_area * (b - dot(b, n) * n);
            by_first = cross(a2, across);
            by_second = cross(across, a1);
        }
    };

    /// The second derivatives of b . n by (a1, a2, b), as blocks with the row first.
    struct NormalCurvature {
        SimdMat3 first_first, first_second, second_second, b_first, b_second;

        NormalCurvature(const Normal& at, const SimdVec3& b) {
            const SimdDouble bn = dot(b, at.n);
            const SimdVec3 across = at.inverse_area * (b - bn * at.n);
            // K = (3 (b.n) n n^T - n b^T - b n^T - (b.n) I) / |N|^2
            SimdMat3 k = outer((SimdDouble(3.0) * bn) * at.n, at.n) - symmetric_outer(at.n, b);
            add_to_diagonal(k, -bn);
            k = (at.inverse_area * at.inverse_area) * k;
            const SimdMat3 x1 = cross_matrix(at.a1), x2 = cross_matrix(at.a2), k1 = multiply(k, x1),
                           k2 = multiply(k, x2);
            first_first = -multiply(x2, k2);
            second_second = -multiply(x1, k1);
            first_second = multiply(x2, k1) - cross_matrix(across);
            // dn/da1 = - (I - n n^T) [a2] / |N|, dn/da2 = (I - n n^T) [a1] / |N|
            SimdMat3 project = outer((-at.inverse_area) * at.n, at.n);
            add_to_diagonal(project, at.inverse_area);
            b_first = -multiply(project, x2);
            b_second = multiply(project, x1);
        }
    };

    struct NodeFactor {
        int node;
        double factor;
    };
    static constexpr std::array<NodeFactor, 4> bend_of(int i) {
        return {{{i, 4.0},
                 {six_nodes::middle(i), 4.0},
                 {six_nodes::middle((i + 1) % 3), -4.0},
                 {six_nodes::middle((i + 2) % 3), -4.0}}};
    }
    /// Derivatives of the shape functions at point p, from corner 0 towards the two other corners.
    static constexpr const std::array<double, 6>& first(int p) { return firsts_[p]; }
    static constexpr const std::array<double, 6>& second(int p) { return seconds_[p]; }
    /// Half the weight of point p times the value of a test function there.
    static double weight(int i, int k, int p) { return weights_[3 * i + k][p]; }
    static SimdVec3 combination(const std::array<double, 6>& by_node, const SimdVec3 x[6]) {
        SimdVec3 sum = SimdDouble(by_node[0]) * x[0];
        for (int a = 1; a < 6; ++a) sum += SimdDouble(by_node[a]) * x[a];
        return sum;
    }

    static constexpr std::array<std::array<double, 6>, points> firsts_ = six_nodes::inside_towards(2, 1.0),
                                                               seconds_ = six_nodes::inside_towards(1, -1.0);
    static constexpr std::array<std::array<double, points>, 9> weights_ = [] {
        std::array<std::array<double, points>, 9> all{};
        for (int r = 0; r < 9; ++r)
            for (int p = 0; p < points; ++p)
                all[r][p] = 0.5 * six_nodes::inside[p].weight *
                            six_nodes::test(r / 3, r % 3, six_nodes::inside[p].at);
        return all;
    }();

    Normal at_[points];
    SimdVec3 bend_[3];
};

}  // namespace magshell
