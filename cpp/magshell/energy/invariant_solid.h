// InvariantSolid: energy densities of a solid that depend on invariants of F. One point per SIMD lane.
//
//   W = w(I1, J) + U(J)  or  w(I1, I2, J) + U(J),   I1 = |F|^2, I2 = |cof F|^2, J = det F     [J/m3]
//   P = s F + p cof F + t G,   s = 2 dw/dI1, p = dw/dJ + U', t = 2 dw/dI2                     [Pa]
//   G = dI2/dF / 2 = I1 F - B F,   B = F F^T
//
// U may be evaluated at the mean J of an element. Mixed Newton stores the stresses s and p: besides them P is
// linear in F, so rotations within a trial step do not spoil anything else. A law w that grows without bound
// towards J = 0 stores the invariants instead, evaluates its derivatives there, and takes the derivative with respect to J as a
// secant to the J of the trial step: rotations have made that J larger, its own stiffness is too small for the
// stored stress, and the tangent would become indefinite.
//
// A law is a struct in terms/solid/solid_*.cpp that provides
//     constants                       their number; by LameSolid or IsochoricSolid, with the moduli for small strains
//     refuses_inversion               true if flat and inverted elements have no energy
//     constant_shear                  true if s is the second constant, mu, in every state
//     has_i2                          true if w depends on I2; such a law refuses inversion
//     derivatives(c, I1, J)           w and its derivatives; derivatives(c, I1, I2, J) with I2
//     volumetric(c, J)                U, U', U''
// Both are linear in the constants. A material for which they are not derives from InvariantSolid and has its own
// work_by_constants and pressure_by_constants.
#pragma once

#include <type_traits>

#include "magshell/core/simd_functions.h"
#include "magshell/strain/deformation.h"

namespace magshell {

/// The Lame constants of a material for small strains, which its viscosity uses.
struct RestModuli {
    SimdDouble lambda, mu;  // [Pa]
};

/// A constant of a material as users set it: one number per element, or `width` of them.
struct NamedConstant {
    const char* name;
    const char* unit;
    int width = 1;
};

/// The k-th of n constants is one, the others are zero.
template <int n>
struct UnitConstants {
    SimdDouble at[n];

    explicit UnitConstants(int k) {
        for (int i = 0; i < n; ++i) at[i] = SimdDouble(i == k ? 1.0 : 0.0);
    }
};

/// The base of materials whose constants are lambda and mu.
struct LameSolid {
    static constexpr int constants = 2;
    static constexpr bool has_i2 = false;

    static RestModuli rest_moduli(const SimdDouble c[]) { return {c[0], c[1]}; }
    static void rest_moduli_vjp(const SimdDouble[], const RestModuli& by, SimdDouble out[]) {
        out[0] += by.lambda;
        out[1] += by.mu;
    }
};

/// w, and its derivatives with respect to I1 and J.
struct InvariantDerivatives {
    SimdDouble w, by_i, by_j, by_ii, by_ij, by_jj;
};

/// The derivatives of w(I1, I2, J), also by I2.
struct ThreeInvariantDerivatives : InvariantDerivatives {
    SimdDouble by_2, by_i2, by_22, by_2j;
};

/// The part of the energy that depends on the measure of volume only, with its first and second derivatives.
struct Volumetric {
    SimdDouble energy, pressure, bulk;
};

/// Returns k/2 (v - 1)^2 and its derivatives.
inline Volumetric quadratic_volume(const SimdDouble& k, const SimdDouble& v) {
    const SimdDouble change = v - SimdDouble(1.0);
    return {SimdDouble(0.5) * k * change * change, k * change, k};
}

/// The second invariant I2 and G, for laws without it empty.
template <bool present>
struct SecondInvariant {
    explicit SecondInvariant(const SimdMat3&, const SimdMat3&, const SimdDouble&) {}
};
template <>
struct SecondInvariant<true> {
    SimdDouble i2;
    SimdMat3 half_gradient;  // G

    SecondInvariant(const SimdMat3& f, const SimdMat3& cof, const SimdDouble& i1)
        : i2(double_dot(cof, cof)), half_gradient(i1 * f - multiply(multiply(f, transpose(f)), f)) {}
};

template <class Law>
struct InvariantSolid : Law {
    static constexpr bool has_i2 = Law::has_i2;
    static constexpr int stresses = Law::constant_shear ? 1 : has_i2 ? 3 : 2;
    static constexpr int stored_measures = !Law::refuses_inversion ? 0 : has_i2 ? 3 : 2;

    SimdMat3 f, cof;
    SimdDouble i1, j, trial;  // trial: det F, even if j was replaced
    [[no_unique_address]] SecondInvariant<has_i2> second;

    explicit InvariantSolid(const SimdMat3& gradient)
        : f(gradient),
          cof(cofactor(f)),
          i1(double_dot(f, f)),
          j(determinant(f, cof)),
          trial(j),
          second(f, cof, i1) {}

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

    SimdDouble energy(const SimdDouble c[]) const { return derivatives(c).w; }

    void stress(const SimdDouble c[], const SimdDouble& pressure, SimdDouble s[]) const {
        const Derivatives w = derivatives(c);
        s[0] = w.by_j + pressure;
        if constexpr (stresses >= 2) s[1] = SimdDouble(2.0) * w.by_i;
        if constexpr (has_i2) s[2] = SimdDouble(2.0) * w.by_2;
    }

    void stress_rate(const SimdDouble c[], const SimdMat3& d, SimdDouble pressure_rate,
                     SimdDouble s[]) const {
        static_assert(!has_i2, "a law with I2 stores measures instead");
        const Derivatives w = derivatives(c);
        const SimdDouble di = SimdDouble(2.0) * double_dot(f, d), dj = double_dot(cof, d);
        s[0] = w.by_jj * dj + pressure_rate;
        if constexpr (stresses == 2) {
            s[0] += w.by_ij * di;
            s[1] = SimdDouble(2.0) * (w.by_ii * di + w.by_ij * dj);
        }
    }

    SimdMat3 piola(const SimdDouble c[], const SimdDouble s[]) const {
        const SimdMat3 p = shear(c, s) * f + s[0] * cof;
        if constexpr (has_i2)
            return p + s[2] * second.half_gradient;
        else
            return p;
    }

    /// Computes J, I1 and I2 at the end of a linearized step, at least a tenth of their current values.
    void measures_after(const SimdMat3& d, SimdDouble out[]) const {
        out[0] = max(j + double_dot(cof, d), SimdDouble(0.1) * j);
        out[1] = max(i1 + SimdDouble(2.0) * double_dot(f, d), SimdDouble(0.1) * i1);
        if constexpr (has_i2)
            out[2] = max(second.i2 + SimdDouble(2.0) * double_dot(second.half_gradient, d),
                         SimdDouble(0.1) * second.i2);
    }
    /// Evaluates the law at these measures from now on.
    void take_measures(const SimdDouble given[]) {
        j = given[0];
        i1 = given[1];
        if constexpr (has_i2) second.i2 = given[2];
    }

    /// Computes dP/dc : d of w for each constant c, in which w is linear.
    void work_by_constants(const SimdDouble[], const SimdMat3& d, SimdDouble work[]) const {
        for (int k = 0; k < Law::constants; ++k) {
            const UnitConstants<Law::constants> unit(k);
            const Derivatives w = derivatives(unit.at);
            work[k] = SimdDouble(2.0) * w.by_i * double_dot(f, d) + w.by_j * double_dot(cof, d);
            if constexpr (has_i2) work[k] += SimdDouble(2.0) * w.by_2 * double_dot(second.half_gradient, d);
        }
    }
    static void pressure_by_constants(const SimdDouble[], const SimdDouble& measure, SimdDouble by[]) {
        for (int k = 0; k < Law::constants; ++k) {
            const UnitConstants<Law::constants> unit(k);
            by[k] = Law::volumetric(unit.at, measure).pressure;
        }
    }

  private:
    using Derivatives = std::conditional_t<has_i2, ThreeInvariantDerivatives, InvariantDerivatives>;

    Derivatives derivatives(const SimdDouble c[]) const {
        if constexpr (has_i2)
            return Law::derivatives(c, i1, second.i2, j);
        else
            return Law::derivatives(c, i1, j);
    }

    static SimdDouble shear(const SimdDouble c[], const SimdDouble s[]) {
        if constexpr (stresses >= 2) return s[1];
        return c[1];
    }

    // The part of the Hessian's blocks that comes from I2. With f_k = F g_k and t = 2 dw/dI2, besides the products
    // of gradients,
    //   t (2 f_k f_l^T - f_l f_k^T + (I1 g_k . g_l - f_k . f_l) I - g_k . g_l B)
    template <int N>
    class SecondTangent {
      public:
        void set(const InvariantSolid& at, const Derivatives& w, const SimdDouble& t,
                 const SimdDouble& volume, const SimdVec3* g, const SimdVec3* c, const SimdVec3* i,
                 SimdVec3* to_c, SimdVec3* to_i) {
            t_ = volume * t;
            left_ = t_ * multiply(at.f, transpose(at.f));
            i1_ = left_.at[0] + left_.at[4] + left_.at[8];
            const SimdDouble cc = SimdDouble(4.0) * volume * w.by_22, jc = SimdDouble(2.0) * volume * w.by_2j,
                             ic = SimdDouble(4.0) * volume * w.by_i2;
            for (int k = 0; k < N; ++k) {
                m_[k] = multiply(at.second.half_gradient, g[k]);
                to_m_[k] = cc * m_[k] + jc * c[k] + ic * i[k];
                to_c[k] += jc * m_[k];
                to_i[k] += ic * m_[k];
            }
        }

        void add_block(int k, int l, const SimdDouble& gg, const SimdVec3* f, SimdMat3& h) const {
            h += outer(to_m_[k], m_[l]);
            h += outer((t_ + t_) * f[k], f[l]);
            h += outer(-t_ * f[l], f[k]);
            h += -gg * left_;
            add_to_diagonal(h, i1_ * gg - t_ * dot(f[k], f[l]));
        }

      private:
        SimdDouble t_, i1_;  // i1_: t I1
        SimdMat3 left_;      // t B
        SimdVec3 m_[N], to_m_[N];
    };

  public:
    /// The blocks of the Hessian at one point, for nodes with given shape function gradients and a given
    /// volume.
    template <int N>
    class Tangent {
      public:
        Tangent(const InvariantSolid& at, const SimdDouble c[], const SimdDouble s[], const SimdDouble& bulk,
                const SimdDouble& volume, const SimdVec3* gradients)
            : g_(gradients), f_(volume * (s[0] * at.f)), shear_(volume * at.shear(c, s)) {
            const Derivatives w = at.derivatives(c);
            // The secant of -mu/J, for laws whose w depends on J only through it.
            const SimdDouble own =
                stresses == 1 && stored_measures > 0 ? w.by_jj * (at.j / at.trial) : w.by_jj;
            const SimdDouble jj = volume * (own + bulk);
            for (int k = 0; k < N; ++k) {
                c_[k] = multiply(at.cof, g_[k]);
                to_c_[k] = jj * c_[k];
            }
            if constexpr (stresses >= 2) {
                const SimdDouble ii = SimdDouble(4.0) * volume * w.by_ii,
                                 ij = SimdDouble(2.0) * volume * w.by_ij;
                for (int k = 0; k < N; ++k) {
                    i_[k] = multiply(at.f, g_[k]);
                    to_i_[k] = ii * i_[k] + ij * c_[k];
                    to_c_[k] += ij * i_[k];
                }
            }
            if constexpr (has_i2) second_.set(at, w, s[2], volume, g_, c_, i_, to_c_, to_i_);
        }

        SimdMat3 block(int k, int l) const {
            SimdMat3 h = outer(to_c_[k], c_[l]);
            if constexpr (stresses >= 2) h += outer(to_i_[k], i_[l]);
            const SimdDouble gg = dot(g_[k], g_[l]);
            add_to_diagonal(h, shear_ * gg);
            if constexpr (has_i2) second_.add_block(k, l, gg, i_, h);
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

        struct Empty {};

        const SimdVec3* g_;
        SimdMat3 f_;
        SimdDouble shear_;
        SimdVec3 c_[N], to_c_[N], i_[stresses >= 2 ? N : 1], to_i_[stresses >= 2 ? N : 1];
        [[no_unique_address]] std::conditional_t<has_i2, SecondTangent<N>, Empty> second_;
    };
};

}  // namespace magshell
