// MagneticSolid: the Zeeman energy of a magnetized solid in an applied field, at an integration point of an
// element with N nodes.
//
//   E_p = - V_p (F M~_r) . B(x_p)                                                                        [J]
//
// With F = sum x_k g_k^T, x_p = sum N_k x_k and alpha_k = g_k . M~_r, which add up to zero,
//
//   F M~_r = sum alpha_k x_k = m
//   dE/dx_k = - V_p (alpha_k B + N_k G^T m)                                       G = dB/dx
//   d2E/dx_k dx_l = - V_p (alpha_k N_l G + N_k alpha_l G^T + N_k N_l d2(m . B)/dx dx)
//
// In a uniform field the force does not depend on the deformation. One element per SIMD lane.
#pragma once

#include <array>

#include "magshell/core/vector3.h"
#include "magshell/energy/magnetic.h"
#include "magshell/strain/deformation.h"
#include "magshell/strain/push_forward.h"

namespace magshell {

template <int N>
struct MagneticSolid : PushForward<N> {  // alpha_k [A/m2]
    using PushForward<N>::alpha;

    SimdDouble volume;  // V_p [m3]

    SimdVec3 magnetization(const SimdVec3 x[N]) const { return this->at(x); }

    static SimdVec3 position(const std::array<double, N>& shapes, const SimdVec3 x[N]) {
        SimdVec3 at = SimdDouble(shapes[0]) * x[0];
        for (int k = 1; k < N; ++k) at += SimdDouble(shapes[k]) * x[k];
        return at;
    }

    SimdDouble energy(const SimdVec3 x[N], const SimdVec3& flux) const {
        return -volume * dot(magnetization(x), flux);
    }

    /// Adds the nodal gradients of a field taken as uniform.
    void add_gradient(const SimdVec3& flux, SimdVec3 g[N]) const {
        for (int k = 0; k < N; ++k) g[k] += (-volume * alpha[k]) * flux;
    }

    /// Adds the part of the gradient that is due to the gradient of the field.
    void add_gradient_by_position(const std::array<double, N>& shapes, const SimdVec3 x[N],
                                  const Magnetic::Field& field, SimdVec3 g[N]) const {
        const SimdVec3 pull = -volume * multiply(transpose(field.gradient), magnetization(x));
        for (int k = 0; k < N; ++k) g[k] += SimdDouble(shapes[k]) * pull;
    }

    /// Adds lower blocks at lower_index(k, l).
    void add_hessian(const std::array<double, N>& shapes, const Magnetic::Field& field, SimdMat3 h[]) const {
        const SimdMat3 along = -volume * field.gradient, across = transpose(along),
                       twice = -volume * field.curvature;
        for (int k = 0; k < N; ++k)
            for (int l = 0; l <= k; ++l)
                h[lower_index(k, l)] += (SimdDouble(shapes[l]) * alpha[k]) * along +
                                        (SimdDouble(shapes[k]) * alpha[l]) * across +
                                        SimdDouble(shapes[k] * shapes[l]) * twice;
    }
};

}  // namespace magshell
