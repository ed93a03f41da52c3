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
#include "magshell/energy/magnetic_face.h"
#include "magshell/strain/deformation.h"
#include "magshell/strain/push_forward.h"

namespace magshell {

template <int N>
struct MagneticSolid : PushForward<N> {  // alpha_k [A/m2]
    using PushForward<N>::alpha;

    SimdDouble volume;  // V_p [m3]

    static constexpr bool is_linear = true;

    void set(int lane, const Eigen::Matrix<double, N, 3>& g, const Vec3& m, double point_volume) {
        const Eigen::Matrix<double, N, 1> coordinates = g * m;
        volume.set(lane, point_volume);
        for (int k = 0; k < N; ++k) alpha[k].set(lane, coordinates[k]);
    }

    /// The magnetization of a point at the positions x of its nodes.
    class Stretched {
      public:
        Stretched(const MagneticSolid& point, const SimdVec3 x[N]) : point_(point), x_(x) {}

        SimdVec3 magnetization() const { return point_.PushForward<N>::at(x_); }

        SimdDouble energy(const SimdVec3& flux) const { return -point_.volume * dot(magnetization(), flux); }

        /// Adds the nodal gradients of a field taken as uniform.
        void add_gradient(const SimdVec3& flux, SimdVec3 g[N]) const {
            for (int k = 0; k < N; ++k) g[k] += (-point_.volume * point_.alpha[k]) * flux;
        }

        /// Adds the part of the gradient that is due to the gradient of the field.
        void add_gradient_by_position(const std::array<SimdDouble, N>& shapes, const FieldAtPoint& field,
                                      SimdVec3 g[N]) const {
            const SimdVec3 pull = -point_.volume * multiply(transpose(field.gradient), magnetization());
            for (int k = 0; k < N; ++k) g[k] += shapes[k] * pull;
        }

        /// Does nothing: in a field taken as uniform the Hessian is zero.
        void add_hessian(const SimdVec3&, SimdMat3*) const {}

        /// Adds lower blocks at lower_index(k, l).
        void add_hessian_by_position(const std::array<SimdDouble, N>& shapes, const FieldAtPoint& field,
                                     SimdMat3 h[]) const {
            const SimdMat3 along = -point_.volume * field.gradient, across = transpose(along),
                           twice = -point_.volume * field.curvature;
            for (int k = 0; k < N; ++k)
                for (int l = 0; l <= k; ++l)
                    h[lower_index(k, l)] += (shapes[l] * point_.alpha[k]) * along +
                                            (shapes[k] * point_.alpha[l]) * across +
                                            (shapes[k] * shapes[l]) * twice;
        }

      private:
        const MagneticSolid& point_;
        const SimdVec3* x_;
    };

    Stretched deformed(const SimdVec3 x[N]) const { return Stretched(*this, x); }
};

/// Returns the position of a point with given values of the shape functions.
template <int N>
SimdVec3 position_of(const std::array<SimdDouble, N>& shapes, const SimdVec3 x[N]) {
    SimdVec3 at = shapes[0] * x[0];
    for (int k = 1; k < N; ++k) at += shapes[k] * x[k];
    return at;
}

}  // namespace magshell
