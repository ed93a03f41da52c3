// InducedFace: the energy of a triangle of a film with the susceptibility chi in an applied field B. Its magnetization follows the field,
//
//   M = (chi B_t + chi/(1 + chi) B_n n)/mu_0 = along B - across (n . B) n       along = chi/mu_0,  across = chi^2/((1 + chi) mu_0)
//   E_f = - A~ h sum_p w_p M . B/2                                                                        B and M at the points x_p
//
// The film is thin: along its plane the field inside is the applied one; across it is B_n/(1 + chi), as B_n passes through (demagnetizing
// factors 0, 0 and 1). A~ h is the volume at rest, which contains a fixed amount of the magnetic material. Half of M . B, as M grows
// with B.
//
//   x_p = sum_a s_pa y_a,   y = (x_0, x_1, x_2, n),   s_p = (barycentric coordinates, height [m] over the middle surface)
//
// With G = dB/dx, C = d2(M . B)/dx2 for a fixed M, P = dM/dB and V = w_p A~ h the derivatives of a point's energy by x_p and by the n in M
// are
//
//   by x_p: - V G^T M                 by n: V across (n . B) B
//   by x_p, x_p: - V (G^T P G + C)    by n, x_p: V across (B n^T + (n . B) 1) G       by n, n: V across B B^T
//
// They are summed over the points by y first, and then taken to the nodes. One face per SIMD lane.
#pragma once

#include <string_view>

#include "magshell/energy/magnetic_face.h"

namespace magshell {

struct InducedFace : FaceFrame {
    static constexpr std::string_view name = "induced magnetization";

    struct Element {
        SimdDouble volume;         // A~ h [m3]
        SimdDouble along, across;  // chi/mu_0, chi^2/((1 + chi) mu_0) [A/(T m)]
    };

    /// A point of the face with the field there.
    struct Point {
        SimdDouble weight, share[4];  // w_p, s_p
        FieldAtPoint field;           // the curvature is that of M . B, M of magnetization()
    };

    /// First derivatives with respect to y.
    struct Gradient {
        SimdVec3 by[4];
    };

    /// First derivative with respect to n, and second ones with respect to y.
    struct Hessian {
        SimdVec3 by_normal;
        SimdMat3 nodes[6];        // by x_a, x_b, at lower_index(a, b)
        SimdMat3 normal_node[3];  // by n (rows) and x_a (columns)
        SimdMat3 normal;          // by n, n
    };

    using FaceFrame::FaceFrame;

    SimdVec3 magnetization(const Element& e, const SimdVec3& b) const {
        return e.along * b - (e.across * dot(b, normal)) * normal;
    }

    /// Returns the energy of a point but for its weight.
    SimdDouble energy(const Element& e, const SimdVec3& b) const {
        return (SimdDouble(-0.5) * e.volume) * dot(magnetization(e, b), b);
    }

    /// Adds a point. If the field does not vary, its gradient and curvature are not read.
    void add(const Element& e, const Point& at, bool varies, Gradient& out) const {
        const SimdDouble volume = at.weight * e.volume;
        const SimdVec3& b = at.field.flux;
        out.by[3] += (volume * e.across * dot(b, normal)) * b;
        if (!varies) return;
        const SimdVec3 pull = -volume * transposed_times(at.field.gradient, magnetization(e, b));
        for (int a = 0; a < 4; ++a) out.by[a] += at.share[a] * pull;
    }

    void add(const Element& e, const Point& at, bool varies, Hessian& out) const {
        const SimdDouble volume = at.weight * e.volume, across = volume * e.across;
        const SimdVec3& b = at.field.flux;
        const SimdDouble through = dot(b, normal);
        out.by_normal += (across * through) * b;
        out.normal += across * outer(b, b);
        if (!varies) return;
        const SimdMat3& g = at.field.gradient;
        const SimdVec3 slope = transposed_times(g, normal);
        out.by_normal += (-at.share[3] * volume) * transposed_times(g, magnetization(e, b));
        const SimdMat3 induced = e.along * g - e.across * outer(normal, slope);  // P G
        const SimdMat3 by_place = -volume * (multiply(transpose(g), induced) + at.field.curvature),
                       mixed = across * (outer(b, slope) + through * g);
        const SimdMat3 raised = mixed + at.share[3] * by_place;
        for (int k = 0; k < 3; ++k) {
            for (int l = 0; l <= k; ++l)
                out.nodes[lower_index(k, l)] += (at.share[k] * at.share[l]) * by_place;
            out.normal_node[k] += at.share[k] * raised;
        }
        out.normal += at.share[3] * (raised + transpose(mixed));
    }

    /// Computes the gradient with respect to the nodes.
    void by_nodes(const Gradient& by, SimdVec3 g[3]) const {
        const SimdVec3 p = tangential(by.by[3]);
        const SimdVec3 by1 = cross(a2, p), by2 = cross(p, a1);
        g[0] = by.by[0] - (by1 + by2);
        g[1] = by.by[1] + by1;
        g[2] = by.by[2] + by2;
    }

    /// Computes the lower blocks by the nodes, at lower_index(k, l).
    void by_nodes(const Hessian& by, SimdMat3 h[6]) const {
        SimdMat3 h11, h12, h22, turned[3];  // N_k^T
        normal_hessian(SimdDouble(1.0), by.by_normal, h11, h12, h22);
        node_blocks(h11, h12, h22, h);
        normal_by_nodes(turned);
        for (int k = 0; k < 3; ++k) {
            const SimdMat3 left = multiply(turned[k], by.normal);
            for (int l = 0; l <= k; ++l)
                h[lower_index(k, l)] += by.nodes[lower_index(k, l)] + multiply(left, transpose(turned[l])) +
                                        multiply(turned[k], by.normal_node[l]) +
                                        transpose(multiply(turned[l], by.normal_node[k]));
        }
    }
};

}  // namespace magshell
