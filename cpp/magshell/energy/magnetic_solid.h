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
#include "magshell/strain/pushed_forward_vector.h"

namespace magshell {

template <int N>
struct MagneticSolid : PushedForwardVector<N> {  // alpha_k [A/m2]
    using PushedForwardVector<N>::alpha;

    Pack volume;  // V_p [m3]

    Pack3 magnetization(const Pack3 x[N]) const { return this->at(x); }

    static Pack3 position(const std::array<double, N>& shapes, const Pack3 x[N]) {
        Pack3 at = Pack(shapes[0]) * x[0];
        for (int k = 1; k < N; ++k) at += Pack(shapes[k]) * x[k];
        return at;
    }

    Pack energy(const Pack3 x[N], const Pack3& flux) const { return -volume * dot(magnetization(x), flux); }

    /// Adds the nodal gradients of a field taken as uniform.
    void add_gradient(const Pack3& flux, Pack3 g[N]) const {
        for (int k = 0; k < N; ++k) g[k] += (-volume * alpha[k]) * flux;
    }

    /// Adds the part of the gradient that is due to the gradient of the field.
    void add_gradient_by_position(const std::array<double, N>& shapes, const Pack3 x[N],
                                  const Magnetic::Field& field, Pack3 g[N]) const {
        const Pack3 pull = -volume * multiply(transpose(field.gradient), magnetization(x));
        for (int k = 0; k < N; ++k) g[k] += Pack(shapes[k]) * pull;
    }

    /// Adds lower blocks at lower_index(k, l).
    void add_hessian(const std::array<double, N>& shapes, const Magnetic::Field& field, Pack33 h[]) const {
        const Pack33 along = -volume * field.gradient, across = transpose(along),
                     twice = -volume * field.curvature;
        for (int k = 0; k < N; ++k)
            for (int l = 0; l <= k; ++l)
                h[lower_index(k, l)] += (Pack(shapes[l]) * alpha[k]) * along +
                                        (Pack(shapes[k]) * alpha[l]) * across +
                                        Pack(shapes[k] * shapes[l]) * twice;
    }
};

}  // namespace magshell
