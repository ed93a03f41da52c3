// MagneticFace: the Zeeman energy of a uniformly magnetized triangle in an applied field, for any law of its magnetization.
//
//   E_f = - A~ h M . B(x_b)                                                         [J]   [Chen22] (24)
//
// A law (magnetic.h, magnetic_rotating.h) derives from MagneticFace<Law> and provides
//
//   struct Element                        A~ h, the coordinates (alpha, beta, gamma) of M~_r, and what else it needs of the rest shape
//   Law(x, element)                       at corners x
//   frame(columns)                        f_1, f_2, n with M = alpha f_1 + beta f_2 + gamma n
//   frame_rate(rate, columns)             their rates for given rates of the corners
//   by_edges(element, b, d1, d2)          d(M . b)/da_1 and d(M . b)/da_2 for a fixed b
//   edge_hessian(element, b, h11, h12, h22)  the second derivatives of - A~ h M . b by a_1 and a_2
//   rest_frame(a1, a2), set_rest(a1, a2, element, lane), is_linear(coordinates)
//
// One face per SIMD lane.
#pragma once

#include "magshell/energy/face_frame.h"
#include "magshell/energy/symmetric3.h"

namespace magshell {

/// The applied field at a point. Gradient and curvature are set only if the field varies in space.
struct FieldAtPoint {
    SimdVec3 flux;       // B                      [T]
    SimdMat3 gradient;   // dB_i/dx_j              [T/m]
    SimdMat3 curvature;  // d2(M . B)/dx_j dx_k    [A/m T/m2]
};

/// Returns G^T v.
inline SimdVec3 transposed_times(const SimdMat3& matrix, const SimdVec3& v) {
    const SimdDouble* g = matrix.at;
    return {g[0] * v.x + g[3] * v.y + g[6] * v.z, g[1] * v.x + g[4] * v.y + g[7] * v.z,
            g[2] * v.x + g[5] * v.y + g[8] * v.z};
}

template <class Law>
struct MagneticFace : FaceFrame {
    using FaceFrame::FaceFrame;

    template <class Element>
    SimdDouble energy(const Element& e, const SimdVec3& flux) const {
        return -e.volume * dot(law().magnetization(e), flux);
    }

    template <class Element>
    void gradient(const Element& e, const SimdVec3& flux, SimdVec3 g[3]) const {
        SimdVec3 d1, d2;
        law().by_edges(e, flux, d1, d2);
        g[1] = -(e.volume * d1);
        g[2] = -(e.volume * d2);
        g[0] = -(g[1] + g[2]);
    }

    /// Returns the part of each node's gradient that is due to the gradient of the field: - A~ h (dB/dx)^T M / 3.
    template <class Element>
    SimdVec3 gradient_by_position(const Element& e, const FieldAtPoint& field) const {
        const SimdVec3 m = law().magnetization(e);
        const SimdVec3 pull = transposed_times(field.gradient, m);
        return (e.volume * SimdDouble(-1.0 / 3.0)) * pull;
    }

    /// Computes the lower blocks at lower_index(k, l) in a field taken as uniform.
    template <class Element>
    void hessian(const Element& e, const SimdVec3& flux, SimdMat3 h[6]) const {
        SimdMat3 h11, h12, h22;
        law().edge_hessian(e, flux, h11, h12, h22);
        node_blocks(h11, h12, h22, h);
    }

    /// Adds the part due to the variation of the field in space: d2(M . B(x_b)) with one or two derivatives with respect to x_b.
    template <class Element>
    void add_hessian_by_position(const Element& e, const FieldAtPoint& field, SimdMat3 h[6]) const {
        SimdMat3 mixed[3];
        by_node(e, field.gradient, mixed);
        const SimdMat3 both = (e.volume * SimdDouble(-1.0 / 9.0)) * field.curvature;
        const SimdDouble third = e.volume * SimdDouble(-1.0 / 3.0);
        for (int k = 0; k < 3; ++k)
            for (int l = 0; l <= k; ++l)
                h[lower_index(k, l)] += both + third * (mixed[k] + transpose(mixed[l]));
    }

    /// Computes (dM/dx_k)^T G for each node k: d(M . G_j)/dx_k of the columns G_j, row = component of the node, column = j.
    template <class Element>
    void by_node(const Element& e, const SimdMat3& g, SimdMat3 out[3]) const {
        for (int j = 0; j < 3; ++j) {
            SimdVec3 d1, d2;
            law().by_edges(e, {g.at[j], g.at[3 + j], g.at[6 + j]}, d1, d2);
            const SimdVec3 d0 = -(d1 + d2);
            const SimdVec3* of_node[3] = {&d0, &d1, &d2};
            for (int k = 0; k < 3; ++k) {
                out[k].at[j] = of_node[k]->x;
                out[k].at[3 + j] = of_node[k]->y;
                out[k].at[6 + j] = of_node[k]->z;
            }
        }
    }

  private:
    const Law& law() const { return static_cast<const Law&>(*this); }
};

}  // namespace magshell
