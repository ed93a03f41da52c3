// StVenantKirchhoff: St. Venant-Kirchhoff law of a solid, and the operations that all laws in Green's strain E
// = (F^T F - I)/2 share. One point per SIMD lane.
//
//   W = mu tr(E^2) + lam/2 (tr E)^2                                               [J/m3]
//   P = F S,   S = 2 mu E + p I,   p = lam tr E                                   [Pa]
//
// The measure of volume is 1 + tr E. Mixed Newton stores the stresses S, as it does for a shell.
#pragma once

#include "magshell/energy/invariant_solid.h"

namespace magshell {

// Symmetric matrices as six numbers, in the order 00 11 22 12 02 01.
struct Green {
    static constexpr int at[3][3] = {{0, 5, 4}, {5, 1, 3}, {4, 3, 2}};

    static void strain(const SimdMat3& f, SimdDouble e[6]) {
        const SimdMat3 c = transposed_times(f, f);
        for (int i = 0; i < 3; ++i) e[i] = SimdDouble(0.5) * (c.at[4 * i] - SimdDouble(1.0));
        shear(c, SimdDouble(0.5), e);
    }
    /// Computes the symmetric part of F^T D.
    static void rate(const SimdMat3& f, const SimdMat3& d, SimdDouble e[6]) {
        const SimdMat3 a = transposed_times(f, d);
        for (int i = 0; i < 3; ++i) e[i] = a.at[4 * i];
        shear(a + transpose(a), SimdDouble(0.5), e);
    }
    static SimdMat3 matrix(const SimdDouble s[6]) {
        return {{s[0], s[5], s[4], s[5], s[1], s[3], s[4], s[3], s[2]}};
    }
    static SimdDouble trace(const SimdDouble e[6]) { return e[0] + e[1] + e[2]; }
    static SimdDouble double_dot(const SimdDouble a[6], const SimdDouble b[6]) {
        return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] +
               SimdDouble(2.0) * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5]);
    }

  private:
    static void shear(const SimdMat3& a, const SimdDouble& factor, SimdDouble e[6]) {
        e[3] = factor * a.at[5];
        e[4] = factor * a.at[2];
        e[5] = factor * a.at[1];
    }
};

/// The blocks of the Hessian of an energy quadratic in E:
///   (g_k . S g_l) I + lam F g_k (x) F g_l + mu (F g_l (x) F g_k + (g_k . g_l) F F^T)
template <int N>
class QuadraticTangent {
  public:
    QuadraticTangent(const SimdMat3& f, const SimdDouble s[6], const SimdDouble& lam, const SimdDouble& mu,
                     const SimdDouble& volume, const SimdVec3* gradients)
        : g_(gradients),
          left_(volume * mu * multiply(f, transpose(f))),
          lam_(volume * lam),
          mu_(volume * mu) {
        const SimdMat3 stress = volume * Green::matrix(s);
        for (int k = 0; k < N; ++k) {
            f_[k] = multiply(f, g_[k]);
            s_[k] = multiply(stress, g_[k]);
        }
    }

    SimdMat3 block(int k, int l) const {
        SimdMat3 h = dot(g_[k], g_[l]) * left_;
        h += outer(lam_ * f_[k], f_[l]);
        h += outer(mu_ * f_[l], f_[k]);
        add_to_diagonal(h, dot(g_[k], s_[l]));
        return h;
    }

  private:
    const SimdVec3* g_;
    SimdMat3 left_;
    SimdDouble lam_, mu_;
    SimdVec3 f_[N], s_[N];
};

struct StVenantKirchhoff : LameSolid {
    static constexpr int stresses = 6;
    static constexpr bool refuses_inversion = false;
    static constexpr int stored_measures = 0;

    SimdMat3 f;
    SimdDouble e[6];

    explicit StVenantKirchhoff(const SimdMat3& gradient) : f(gradient) { Green::strain(f, e); }

    static Volumetric volumetric(const SimdDouble c[], const SimdDouble& v) {
        return quadratic_volume(c[0], v);
    }

    SimdDouble volume_measure() const { return SimdDouble(1.0) + Green::trace(e); }
    SimdDouble volume_rate(const SimdMat3& d) const { return double_dot(f, d); }
    SimdVec3 volume_gradient(const SimdVec3& g) const { return multiply(f, g); }
    SimdMat3 volume_piola() const { return f; }

    SimdDouble energy(const SimdDouble c[]) const { return c[1] * Green::double_dot(e, e); }

    void stress(const SimdDouble c[], const SimdDouble& pressure, SimdDouble s[]) const {
        respond(c, e, pressure, s);
    }

    void stress_rate(const SimdDouble c[], const SimdMat3& d, SimdDouble pressure_rate,
                     SimdDouble s[]) const {
        SimdDouble rate[6];
        Green::rate(f, d, rate);
        respond(c, rate, pressure_rate, s);
    }

    SimdMat3 piola(const SimdDouble[], const SimdDouble s[]) const { return multiply(f, Green::matrix(s)); }

    void work_by_constants(const SimdDouble[], const SimdMat3& d, SimdDouble work[]) const {
        SimdDouble rate[6];
        Green::rate(f, d, rate);
        work[0] = SimdDouble(0.0);
        work[1] = SimdDouble(2.0) * Green::double_dot(e, rate);
    }
    static void pressure_by_constants(const SimdDouble[], const SimdDouble& v, SimdDouble by[]) {
        by[0] = v - SimdDouble(1.0);
        by[1] = SimdDouble(0.0);
    }

    template <int N>
    struct Tangent : QuadraticTangent<N> {
        Tangent(const StVenantKirchhoff& at, const SimdDouble c[], const SimdDouble s[],
                const SimdDouble& bulk, const SimdDouble& volume, const SimdVec3* gradients)
            : QuadraticTangent<N>(at.f, s, bulk, c[1], volume, gradients) {}
    };

  private:
    static void respond(const SimdDouble c[], const SimdDouble strain[6], const SimdDouble& pressure,
                        SimdDouble s[6]) {
        for (int i = 0; i < 6; ++i) s[i] = SimdDouble(2.0) * c[1] * strain[i];
        for (int i = 0; i < 3; ++i) s[i] += pressure;
    }
};

}  // namespace magshell
