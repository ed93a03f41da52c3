// InvariantSolid: energy densities of a solid that depend on I1 = |F|^2 and J = det F. One point per SIMD lane.
//
//   W = w(I1, J) + U(J)                                                           [J/m3]
//   P = s F + p cof F,   s = 2 dw/dI1,   p = dw/dJ + U'                           [Pa]
//
// U may be evaluated at the mean J of an element. Mixed Newton stores the stresses s and p: besides them P is
// linear in F, so rotations within a trial step do not spoil anything else. A law w that grows without bound
// towards J = 0 stores I1 and J instead, evaluates its derivatives there, and takes the derivative by J as a
// secant to the J of the trial step: rotations have made that J larger, its own stiffness is too small for the
// stored stress, and the tangent would become indefinite.
//
// A law provides
//     constants, refuses_inversion, constant_shear (true if s does not depend on the state)
//     derivatives(c, I1, J)           w and its derivatives
//     volumetric(c, J)                U, U', U''
#pragma once

#include "magshell/core/simd_functions.h"
#include "magshell/strain/deformation.h"

namespace magshell {

/// The Lame constants of a material for small strains, which its viscosity uses.
struct RestModuli {
    SimdDouble lambda, mu;  // [Pa]
};

/// The base of materials whose constants are lambda and mu.
struct LameSolid {
    static constexpr int constants = 2;

    static RestModuli rest_moduli(const SimdDouble c[]) { return {c[0], c[1]}; }
    static void rest_moduli_vjp(const SimdDouble[], const RestModuli& by, SimdDouble out[]) {
        out[0] += by.lambda;
        out[1] += by.mu;
    }
};

/// w, and its derivatives by I1 and J.
struct InvariantDerivatives {
    SimdDouble w, by_i, by_j, by_ii, by_ij, by_jj;
};

/// The part of the energy that depends on the measure of volume only, with its first and second derivatives.
struct Volumetric {
    SimdDouble energy, pressure, bulk;
};

template <class Law>
struct InvariantSolid : LameSolid {
    static constexpr int stresses = Law::constant_shear ? 1 : 2;
    static constexpr bool refuses_inversion = Law::refuses_inversion;
    static constexpr bool keeps_measures = Law::refuses_inversion;

    SimdMat3 f, cof;
    SimdDouble i1, j, trial;  // trial: det F, even if j was replaced

    explicit InvariantSolid(const SimdMat3& gradient)
        : f(gradient), cof(cofactor(f)), i1(double_dot(f, f)), j(determinant(f, cof)), trial(j) {}

    static Volumetric volumetric(const SimdDouble c[], const SimdDouble& measure) {
        return Law::volumetric(c, measure);
    }

    /// Returns U'' as a secant of U' between two volumes.
    static SimdDouble bulk_between(const SimdDouble c[], const SimdDouble& now, const SimdDouble& before) {
        const SimdDouble change = before - now, middle = SimdDouble(0.5) * (now + before);
        const SimdDouble secant =
            (Law::volumetric(c, before).pressure - Law::volumetric(c, now).pressure) / change;
        return where_negative(abs(change) - SimdDouble(1e-3), Law::volumetric(c, middle).bulk, secant);
    }

    SimdDouble volume_measure() const { return j; }
    SimdDouble volume_rate(const SimdMat3& d) const { return double_dot(cof, d); }
    SimdVec3 volume_gradient(const SimdVec3& g) const { return multiply(cof, g); }
    SimdMat3 volume_piola() const { return cof; }

    SimdDouble energy(const SimdDouble c[]) const { return Law::derivatives(c, i1, j).w; }

    void stress(const SimdDouble c[], const SimdDouble& pressure, SimdDouble s[]) const {
        const InvariantDerivatives w = Law::derivatives(c, i1, j);
        s[0] = w.by_j + pressure;
        if constexpr (stresses == 2) s[1] = SimdDouble(2.0) * w.by_i;
    }

    void stress_rate(const SimdDouble c[], const SimdMat3& d, SimdDouble pressure_rate,
                     SimdDouble s[]) const {
        const InvariantDerivatives w = Law::derivatives(c, i1, j);
        const SimdDouble di = SimdDouble(2.0) * double_dot(f, d), dj = double_dot(cof, d);
        s[0] = w.by_jj * dj + pressure_rate;
        if constexpr (stresses == 2) {
            s[0] += w.by_ij * di;
            s[1] = SimdDouble(2.0) * (w.by_ii * di + w.by_ij * dj);
        }
    }

    SimdMat3 piola(const SimdDouble c[], const SimdDouble s[]) const { return shear(c, s) * f + s[0] * cof; }

    /// Computes J and I1 at the end of a linearized step, at least a tenth of their current values.
    void measures_after(const SimdMat3& d, SimdDouble out[2]) const {
        out[0] = max(j + double_dot(cof, d), SimdDouble(0.1) * j);
        out[1] = max(i1 + SimdDouble(2.0) * double_dot(f, d), SimdDouble(0.1) * i1);
    }
    /// Evaluates the law at these measures from now on.
    void take_measures(const SimdDouble given[2]) {
        j = given[0];
        i1 = given[1];
    }

    /// Computes dP/dc : d of w for each constant c; these energies are linear in their constants.
    void work_by_constants(const SimdDouble[], const SimdMat3& d, SimdDouble work[]) const {
        for (int k = 0; k < constants; ++k) {
            const SimdDouble unit[2] = {SimdDouble(k == 0 ? 1.0 : 0.0), SimdDouble(k == 1 ? 1.0 : 0.0)};
            const InvariantDerivatives w = Law::derivatives(unit, i1, j);
            work[k] = SimdDouble(2.0) * w.by_i * double_dot(f, d) + w.by_j * double_dot(cof, d);
        }
    }
    static void pressure_by_constants(const SimdDouble[], const SimdDouble& measure, SimdDouble by[]) {
        for (int k = 0; k < constants; ++k) {
            const SimdDouble unit[2] = {SimdDouble(k == 0 ? 1.0 : 0.0), SimdDouble(k == 1 ? 1.0 : 0.0)};
            by[k] = Law::volumetric(unit, measure).pressure;
        }
    }

    /// The blocks of the Hessian at one point, for nodes with given shape function gradients and a given
    /// volume.
    template <int N>
    class Tangent {
      public:
        Tangent(const InvariantSolid& at, const SimdDouble c[], const SimdDouble s[], const SimdDouble& bulk,
                const SimdDouble& volume, const SimdVec3* gradients)
            : g_(gradients), f_(volume * (s[0] * at.f)), shear_(volume * at.shear(c, s)) {
            const InvariantDerivatives w = Law::derivatives(c, at.i1, at.j);
            // The secant of -mu/J, for laws whose w depends on J only through it.
            const SimdDouble own = stresses == 1 && keeps_measures ? w.by_jj * (at.j / at.trial) : w.by_jj;
            const SimdDouble jj = volume * (own + bulk);
            for (int k = 0; k < N; ++k) {
                c_[k] = multiply(at.cof, g_[k]);
                to_c_[k] = jj * c_[k];
            }
            if constexpr (stresses == 2) {
                const SimdDouble ii = SimdDouble(4.0) * volume * w.by_ii,
                                 ij = SimdDouble(2.0) * volume * w.by_ij;
                for (int k = 0; k < N; ++k) {
                    i_[k] = multiply(at.f, g_[k]);
                    to_i_[k] = ii * i_[k] + ij * c_[k];
                    to_c_[k] += ij * i_[k];
                }
            }
        }

        SimdMat3 block(int k, int l) const {
            SimdMat3 h = outer(to_c_[k], c_[l]);
            if constexpr (stresses == 2) h += outer(to_i_[k], i_[l]);
            add_to_diagonal(h, shear_ * dot(g_[k], g_[l]));
            if (k != l) add_cross_matrix(h, multiply(f_, cross(g_[l], g_[k])));
            return h;
        }

      private:
        static void add_cross_matrix(SimdMat3& h, const SimdVec3& v) {
            h.at[1] -= v.z;
            h.at[2] += v.y;
            h.at[3] += v.z;
            h.at[5] -= v.x;
            h.at[6] -= v.y;
            h.at[7] += v.x;
        }

        const SimdVec3* g_;
        SimdMat3 f_;
        SimdDouble shear_;
        SimdVec3 c_[N], to_c_[N], i_[stresses == 2 ? N : 1], to_i_[stresses == 2 ? N : 1];
    };

  private:
    static SimdDouble shear(const SimdDouble c[], const SimdDouble s[]) {
        if constexpr (stresses == 2) return s[1];
        return c[1];
    }
};

}  // namespace magshell
