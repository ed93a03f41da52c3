// Magnetic: the Zeeman energy of a uniformly magnetized linear triangle in an applied field.
//
//   E_f = - A~ h (F_0 M~_r) . B(x_b)                                                [J]   [Chen22] (20), (24)
//
// F_0 maps the reference tangents to the current ones and the reference normal to the current unit normal. With
// the coordinates (alpha, beta, gamma) of M~_r [A/m] in (a~_1, a~_2, n~)
//
//   F_0 M~_r = alpha a_1 + beta a_2 + gamma n,     a_1 = x_1 - x_0,  a_2 = x_2 - x_0.
//
// Derivatives follow [Chen22] (62), (63) without their misprints: the factor is (n~ . M~_r), and the signs are
// those below (checked against automatic differentiation). One face per SIMD lane.
#pragma once

#include <string_view>

#include "magshell/core/vector3.h"
#include "magshell/energy/symmetric3.h"

namespace magshell {

struct Magnetic {
    static constexpr std::string_view name = "magnetic";

    struct Element {
        SimdDouble volume;              // A~ h [m3]
        SimdDouble alpha, beta, gamma;  // M~_r [A/m] in (a~_1, a~_2, n~)
    };

    /// The applied field at the barycenter. Gradient and curvature are set only if the field varies in space.
    struct Field {
        SimdVec3 flux;       // B                      [T]
        SimdMat3 gradient;   // dB_i/dx_j              [T/m]
        SimdMat3 curvature;  // d2(M . B)/dx_j dx_k    [A/m T/m2]
    };

    SimdVec3 a1, a2, normal;
    SimdDouble inverse_area2;  // 1 / |a_1 x a_2|

    explicit Magnetic(const SimdVec3 x[3]) : a1(x[1] - x[0]), a2(x[2] - x[0]) {
        const SimdVec3 across = cross(a1, a2);
        inverse_area2 = SimdDouble(1.0) / sqrt(squared_norm(across));
        normal = inverse_area2 * across;
    }

    SimdVec3 magnetization(const Element& e) const { return e.alpha * a1 + e.beta * a2 + e.gamma * normal; }

    SimdDouble energy(const Element& e, const SimdVec3& flux) const {
        return -e.volume * dot(magnetization(e), flux);
    }

    /// Computes d(M . b)/da_1 and d(M . b)/da_2 for a fixed vector b.
    void by_edges(const Element& e, const SimdVec3& b, SimdVec3& d1, SimdVec3& d2) const {
        const SimdVec3 p = tangential(b);
        d1 = e.alpha * b + e.gamma * cross(a2, p);
        d2 = e.beta * b - e.gamma * cross(a1, p);
    }

    void gradient(const Element& e, const SimdVec3& flux, SimdVec3 g[3]) const {
        SimdVec3 d1, d2;
        by_edges(e, flux, d1, d2);
        g[1] = -(e.volume * d1);
        g[2] = -(e.volume * d2);
        g[0] = -(g[1] + g[2]);
    }

    /// Returns the part of each node's gradient that is due to the gradient of the field: - A~ h (dB/dx)^T M /
    /// 3.
    SimdVec3 gradient_by_position(const Element& e, const Field& field) const {
        const SimdVec3 m = magnetization(e);
        const SimdDouble* g = field.gradient.at;
        const SimdVec3 pull = {g[0] * m.x + g[3] * m.y + g[6] * m.z, g[1] * m.x + g[4] * m.y + g[7] * m.z,
                               g[2] * m.x + g[5] * m.y + g[8] * m.z};
        return (e.volume * SimdDouble(-1.0 / 3.0)) * pull;
    }

    /// Returns the rate of the unit normal for given nodal velocities.
    SimdVec3 normal_rate(const SimdVec3 rate[3]) const {
        return tangential(cross(rate[1] - rate[0], a2) + cross(a1, rate[2] - rate[0]));
    }

    /// Computes the lower blocks at lower_index(k, l) in a field taken as uniform.
    void hessian(const Element& e, const SimdVec3& flux, SimdMat3 h[6]) const {
        const SimdDouble along = dot(normal, flux);
        // K = (3 (n.B) n n^T - n B^T - B n^T - (n.B) I) / |N|^2
        SimdMat3 k = outer((SimdDouble(3.0) * along) * normal, normal) - symmetric_outer(normal, flux);
        add_to_diagonal(k, -along);
        const SimdDouble scale = -e.volume * e.gamma;
        k = (scale * inverse_area2 * inverse_area2) * k;
        const SimdMat3 c1 = cross_matrix(a1), c2 = cross_matrix(a2);
        const SimdMat3 kc1 = multiply(k, c1);
        const SimdMat3 h11 = -multiply(c2, multiply(k, c2)), h22 = -multiply(c1, kc1);
        const SimdMat3 h12 = multiply(c2, kc1) - scale * cross_matrix(tangential(flux));
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

    /// Adds the part due to the variation of the field in space: d2(M . B(x_b)) with one or two derivatives by
    /// x_b.
    void add_hessian_by_position(const Element& e, const Field& field, SimdMat3 h[6]) const {
        SimdMat3 by_node[3];  // d(M . dB/dx_j)/dx_node, row = component of the node, column = j
        for (int j = 0; j < 3; ++j) {
            SimdVec3 d1, d2;
            by_edges(e, {field.gradient.at[j], field.gradient.at[3 + j], field.gradient.at[6 + j]}, d1, d2);
            const SimdVec3 d0 = -(d1 + d2);
            const SimdVec3* of_node[3] = {&d0, &d1, &d2};
            for (int k = 0; k < 3; ++k) {
                by_node[k].at[j] = of_node[k]->x;
                by_node[k].at[3 + j] = of_node[k]->y;
                by_node[k].at[6 + j] = of_node[k]->z;
            }
        }
        const SimdMat3 both = (e.volume * SimdDouble(-1.0 / 9.0)) * field.curvature;
        const SimdDouble third = e.volume * SimdDouble(-1.0 / 3.0);
        for (int k = 0; k < 3; ++k)
            for (int l = 0; l <= k; ++l)
                h[lower_index(k, l)] += both + third * (by_node[k] + transpose(by_node[l]));
    }

  private:
    /// Returns P = (b - n (n . b)) / |N|.
    SimdVec3 tangential(const SimdVec3& b) const { return inverse_area2 * (b - dot(normal, b) * normal); }
};

}  // namespace magshell
