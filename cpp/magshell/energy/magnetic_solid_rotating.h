// RotatingMagneticSolid: the Zeeman energy of a solid whose magnetization turns with it and does not stretch, at an integration
// point of an element with N nodes.
//
//   E_p = - V_p (R M~_r) . B(x_p)                                                                        [J]
//
// F = sum x_k g_k^T = R U = V R is the polar decomposition. With m = R M~_r, rho_k = R g_k, Y = (tr V) I - V, [v] w = v x w and, for a
// fixed b, the moment y = Y^-1 (m x b):
//
//   dR = [omega] R,   omega = Y^-1 sum_k rho_k x dx_k
//   d(b . m)/dx_k = y x rho_k
//   d2(b . m)/dx_k dx_l = - [rho_k] Q [rho_l] + Z_kl [y] - [y] Z_kl
//   Z_kl = [rho_k] Y^-1 [rho_l],   Q = Y^-1 (m b^T - (b . m) I + V [y]) Y^-1, symmetric
//
// Derived from the skew part of R^T dF = (R^T dR) U + dU, checked against differences and torch (tests/core/test_magnetization_laws.py).
// Y is singular where two signed stretches cancel, which takes an inverted element. One element per SIMD lane.
#pragma once

#include <array>

#include "magshell/energy/magnetic_face.h"
#include "magshell/energy/symmetric3.h"
#include "magshell/strain/deformation.h"
#include "magshell/strain/polar.h"

namespace magshell {

template <int N>
struct RotatingMagneticSolid {
    SimdVec3 gradients[N];  // g_k [1/m]
    SimdVec3 remanence;     // M~_r [A/m]
    SimdDouble volume;      // V_p [m3]

    static constexpr bool is_linear = false;

    void set(int lane, const Eigen::Matrix<double, N, 3>& g, const Vec3& m, double point_volume) {
        for (int k = 0; k < N; ++k) set_components(gradients[k], lane, g.row(k).transpose());
        set_components(remanence, lane, m);
        volume.set(lane, point_volume);
    }

    /// The rotation of a point and the quantities that follow from it.
    class Turned {
      public:
        Turned(const RotatingMagneticSolid& point, const SimdVec3 x[N]) : point_(point) {
            const Polar polar(deformation_gradient<N>(x, point.gradients));
            rotation_ = polar.rotation;
            magnetization_ = multiply(rotation_, point.remanence);
            for (int k = 0; k < N; ++k) rho_[k] = multiply(rotation_, point.gradients[k]);
            // V = sum s_i u_i u_i^T,   Y = sum (s_j + s_k) u_i u_i^T
            const SimdDouble* s = polar.stretch;
            stretch_ = sum_of_squares(s, polar.u);
            const SimdDouble one(1.0);
            const SimdDouble inverses[3] = {one / (s[1] + s[2]), one / (s[2] + s[0]), one / (s[0] + s[1])};
            inverse_ = sum_of_squares(inverses, polar.u);
        }

        const SimdVec3& magnetization() const { return magnetization_; }
        const SimdMat3& rotation() const { return rotation_; }
        SimdDouble energy(const SimdVec3& flux) const { return -point_.volume * dot(magnetization_, flux); }

        /// Returns omega for given nodal velocities.
        SimdVec3 spin(const SimdVec3 rate[N]) const {
            SimdVec3 sum = cross(rho_[0], rate[0]);
            for (int k = 1; k < N; ++k) sum += cross(rho_[k], rate[k]);
            return multiply(inverse_, sum);
        }

        /// Adds the nodal gradients of a field taken as uniform.
        void add_gradient(const SimdVec3& flux, SimdVec3 g[N]) const {
            const SimdVec3 y = -point_.volume * turning_moment(flux);
            for (int k = 0; k < N; ++k) g[k] += cross(y, rho_[k]);
        }

        /// Adds the part of the gradient that is due to the gradient of the field.
        void add_gradient_by_position(const std::array<SimdDouble, N>& shapes, const FieldAtPoint& field,
                                      SimdVec3 g[N]) const {
            const SimdVec3 pull = -point_.volume * multiply(transpose(field.gradient), magnetization_);
            for (int k = 0; k < N; ++k) g[k] += shapes[k] * pull;
        }

        /// Adds lower blocks at lower_index(k, l) in a field taken as uniform.
        void add_hessian(const SimdVec3& flux, SimdMat3 h[]) const {
            const SimdMat3 y = cross_matrix(turning_moment(flux));
            SimdMat3 middle = outer(magnetization_, flux) + multiply(stretch_, y);
            add_to_diagonal(middle, -dot(magnetization_, flux));
            const SimdMat3 q = multiply(inverse_, multiply(middle, inverse_));
            const SimdDouble scale = -point_.volume;
            SimdMat3 arms[N];
            for (int k = 0; k < N; ++k) arms[k] = cross_matrix(rho_[k]);
            for (int l = 0; l < N; ++l) {
                const SimdMat3 bent = multiply(q, arms[l]), spun = multiply(inverse_, arms[l]);
                for (int k = l; k < N; ++k) {
                    const SimdMat3 z = multiply(arms[k], spun);
                    h[lower_index(k, l)] +=
                        scale * (multiply(z, y) - multiply(y, z) - multiply(arms[k], bent));
                }
            }
        }

        /// Adds the part due to the variation of the field in space.
        void add_hessian_by_position(const std::array<SimdDouble, N>& shapes, const FieldAtPoint& field,
                                     SimdMat3 h[]) const {
            SimdVec3 columns[3];  // Y^-1 (m x dB/dx_j)
            for (int j = 0; j < 3; ++j)
                columns[j] = turning_moment(
                    {field.gradient.at[j], field.gradient.at[3 + j], field.gradient.at[6 + j]});
            const SimdDouble scale = -point_.volume;
            SimdMat3 by_node[N];  // d(m . dB/dx_j)/dx_k, row = component of the node, column = j
            for (int k = 0; k < N; ++k)
                for (int j = 0; j < 3; ++j) {
                    const SimdVec3 column = scale * cross(columns[j], rho_[k]);
                    by_node[k].at[j] = column.x;
                    by_node[k].at[3 + j] = column.y;
                    by_node[k].at[6 + j] = column.z;
                }
            const SimdMat3 twice = scale * field.curvature;
            for (int k = 0; k < N; ++k)
                for (int l = 0; l <= k; ++l)
                    h[lower_index(k, l)] += shapes[l] * by_node[k] + shapes[k] * transpose(by_node[l]) +
                                            (shapes[k] * shapes[l]) * twice;
        }

      private:
        static SimdMat3 sum_of_squares(const SimdDouble weights[3], const SimdVec3 axes[3]) {
            return outer(weights[0] * axes[0], axes[0]) + outer(weights[1] * axes[1], axes[1]) +
                   outer(weights[2] * axes[2], axes[2]);
        }
        /// Returns y = Y^-1 (m x b).
        SimdVec3 turning_moment(const SimdVec3& b) const {
            return multiply(inverse_, cross(magnetization_, b));
        }

        const RotatingMagneticSolid& point_;
        SimdMat3 rotation_, stretch_, inverse_;  // R, V, Y^-1
        SimdVec3 magnetization_, rho_[N];
    };

    Turned deformed(const SimdVec3 x[N]) const { return Turned(*this, x); }

  private:
    static void set_components(SimdVec3& to, int lane, const Vec3& from) {
        to.x.set(lane, from.x());
        to.y.set(lane, from.y());
        to.z.set(lane, from.z());
    }
};

}  // namespace magshell
