// Guccione: the transversely isotropic law of Guccione et al. 1995 for heart muscle. One point per SIMD lane.
//
//   W = C/2 (e^Q - 1) + K/2 (J - 1)^2                                             [J/m3]
//   Q = bf E_ff^2 + bt (E_ss^2 + E_nn^2 + 2 E_sn^2) + 2 bfs (E_fs^2 + E_fn^2)
//
// in Green's strain E. With e = m . E m and q = |E m|^2, m the unit fibre direction in the reference
// configuration,
//
//   Q = bf e^2 + bt (tr E^2 - 2 q + e^2) + 2 bfs (q - e^2)
//   D = dQ/dE = 2 (bf + bt - 2 bfs) e m (x) m + 2 bt E + 2 (bfs - bt) (m (x) E m + E m (x) m)
//   P = F S + p cof F,   S = C/2 e^Q D,   p = K (J - 1)                           [Pa]
#pragma once

#include <algorithm>

#include "magshell/core/simd_functions.h"
#include "magshell/energy/st_venant_kirchhoff.h"

namespace magshell {

struct Guccione {
    static constexpr int constants = 8;  // C [Pa], bf, bt, bfs, K [Pa], m
    static constexpr NamedConstant named_constants[] = {
        {"stiffness", "Pa"},           {"fibre_exponent", "1"}, {"cross_fibre_exponent", "1"},
        {"fibre_shear_exponent", "1"}, {"bulk_modulus", "Pa"},  {"fibres", "1", 3}};
    static constexpr int stresses = 7;  // S, p
    static constexpr bool refuses_inversion = false;
    static constexpr int stored_measures = 0;

    SimdMat3 f, cof;
    SimdDouble e[6], j;

    explicit Guccione(const SimdMat3& gradient) : f(gradient), cof(cofactor(f)), j(determinant(f, cof)) {
        Green::strain(f, e);
    }

    /// Returns the moduli for small strains across the fibres.
    static RestModuli rest_moduli(const SimdDouble c[]) {
        return {SimdDouble(0.0), SimdDouble(0.5) * c[0] * c[2]};
    }
    static void rest_moduli_vjp(const SimdDouble c[], const RestModuli& by, SimdDouble out[]) {
        out[0] += SimdDouble(0.5) * c[2] * by.mu;
        out[2] += SimdDouble(0.5) * c[0] * by.mu;
    }

    /// Returns a modulus [Pa] of the size of the forces' stiffness.
    static double size(const double c[]) { return c[0] * std::max({c[1], c[2], c[3]}) + c[4]; }

    static Volumetric volumetric(const SimdDouble c[], const SimdDouble& v) {
        return quadratic_volume(c[4], v);
    }

    SimdDouble volume_measure() const { return j; }
    SimdDouble volume_rate(const SimdMat3& d) const { return double_dot(cof, d); }
    SimdVec3 volume_gradient(const SimdVec3& g) const { return multiply(cof, g); }
    SimdMat3 volume_piola() const { return cof; }

    SimdDouble energy(const SimdDouble c[]) const {
        return SimdDouble(0.5) * c[0] * (exp(exponent(c)) - SimdDouble(1.0));
    }

    void stress(const SimdDouble c[], const SimdDouble& pressure, SimdDouble s[]) const {
        SimdDouble d[6];
        linear(c, e, d);
        const SimdDouble scale = growth(c);
        for (int i = 0; i < 6; ++i) s[i] = scale * d[i];
        s[6] = pressure;
    }

    void stress_rate(const SimdDouble c[], const SimdMat3& along, SimdDouble pressure_rate,
                     SimdDouble s[]) const {
        SimdDouble rate[6], d[6], change[6];
        Green::rate(f, along, rate);
        linear(c, e, d);
        linear(c, rate, change);
        const SimdDouble scale = growth(c), grows = Green::double_dot(d, rate);
        for (int i = 0; i < 6; ++i) s[i] = scale * (change[i] + grows * d[i]);
        s[6] = pressure_rate;
    }

    SimdMat3 piola(const SimdDouble[], const SimdDouble s[]) const {
        return multiply(f, Green::matrix(s)) + s[6] * cof;
    }

    void work_by_constants(const SimdDouble c[], const SimdMat3& along, SimdDouble work[]) const {
        SimdDouble rate[6], d[6];
        Green::rate(f, along, rate);
        linear(c, e, d);
        const SimdDouble scale = growth(c), total = Green::double_dot(d, rate);
        work[0] = SimdDouble(0.5) * exp(exponent(c)) * total;
        work[4] = SimdDouble(0.0);
        for (int k = 1; k < 4; ++k) {  // Q and D are linear in each exponent
            const SimdDouble unit[8] = {c[0],
                                        SimdDouble(k == 1 ? 1.0 : 0.0),
                                        SimdDouble(k == 2 ? 1.0 : 0.0),
                                        SimdDouble(k == 3 ? 1.0 : 0.0),
                                        c[4],
                                        c[5],
                                        c[6],
                                        c[7]};
            linear(unit, e, d);
            work[k] = scale * (Green::double_dot(d, rate) + exponent(unit) * total);
        }
        // Derivative with respect to the fibre direction: D:rate = 2 a e (m . L m) + 2 bt E:L + 2 b (E m) . (L m), dQ/dm = 4
        // a e E m + 2 b E^2 m.
        const SimdDouble a = c[1] + c[2] - SimdDouble(2.0) * c[3], b = SimdDouble(2.0) * (c[3] - c[2]);
        const SimdMat3 strain = Green::matrix(e), l = Green::matrix(rate);
        const SimdVec3 m{c[5], c[6], c[7]}, em = multiply(strain, m), lm = multiply(l, m);
        const SimdDouble eff = dot(m, em), lff = dot(m, lm);
        const SimdVec3 by_m =
            (SimdDouble(4.0) * a * lff) * em + (SimdDouble(4.0) * a * eff) * lm +
            (SimdDouble(2.0) * b) * (multiply(strain, lm) + multiply(l, em)) +
            total * ((SimdDouble(4.0) * a * eff) * em + (SimdDouble(2.0) * b) * multiply(strain, em));
        work[5] = scale * by_m.x;
        work[6] = scale * by_m.y;
        work[7] = scale * by_m.z;
    }
    static void pressure_by_constants(const SimdDouble[], const SimdDouble& v, SimdDouble by[]) {
        for (int k = 0; k < constants; ++k) by[k] = k == 4 ? v - SimdDouble(1.0) : SimdDouble(0.0);
    }

    template <int N>
    class Tangent {
      public:
        Tangent(const Guccione& at, const SimdDouble c[], const SimdDouble s[], const SimdDouble& bulk,
                const SimdDouble& volume, const SimdVec3* gradients)
            : g_(gradients),
              pressed_((volume * s[6]) * at.f),
              scale_(volume * at.growth(c)),
              bt_(c[2]),
              b_(SimdDouble(0.5) * (SimdDouble(2.0) * (c[3] - c[2]))),
              a_(SimdDouble(2.0) * (c[1] + c[2] - SimdDouble(2.0) * c[3])),
              left_(multiply(at.f, transpose(at.f))) {
            const SimdVec3 m{c[5], c[6], c[7]};
            SimdDouble d[6];
            at.linear(c, at.e, d);
            const SimdMat3 to_strain = multiply(at.f, Green::matrix(d)), stress = volume * Green::matrix(s);
            fm_ = multiply(at.f, m);
            for (int k = 0; k < N; ++k) {
                along_[k] = dot(m, g_[k]);
                f_[k] = multiply(at.f, g_[k]);
                d_[k] = multiply(to_strain, g_[k]);
                s_[k] = multiply(stress, g_[k]);
                c_[k] = multiply(at.cof, g_[k]);
                to_c_[k] = (volume * bulk) * c_[k];
            }
        }

        // With m_k = m . g_k and f_m = F m; the terms of a, bt and b (half of 2 (bfs - bt)) in this order.
        SimdMat3 block(int k, int l) const {
            const SimdDouble gg = dot(g_[k], g_[l]), mm = along_[k] * along_[l];
            SimdMat3 h = outer(d_[k], d_[l]);
            h += outer((a_ * mm + b_ * gg) * fm_, fm_);
            h += (bt_ * gg + b_ * mm) * left_;
            h += outer(bt_ * f_[l], f_[k]);
            h += outer((b_ * along_[l]) * fm_, f_[k]) + outer((b_ * along_[k]) * f_[l], fm_);
            h = scale_ * h;
            h += outer(to_c_[k], c_[l]);
            add_to_diagonal(h, dot(g_[k], s_[l]));
            if (k != l) h += cross_matrix(multiply(pressed_, cross(g_[l], g_[k])));
            return h;
        }

      private:
        const SimdVec3* g_;
        SimdMat3 pressed_;
        SimdDouble scale_, bt_, b_, a_;
        SimdMat3 left_;
        SimdVec3 fm_, f_[N], d_[N], s_[N], c_[N], to_c_[N];
        SimdDouble along_[N];
    };

  private:
    // Computes D of a strain.
    static void linear(const SimdDouble c[], const SimdDouble strain[6], SimdDouble d[6]) {
        const SimdVec3 m{c[5], c[6], c[7]}, em = multiply(Green::matrix(strain), m);
        const SimdDouble along = SimdDouble(2.0) * (c[1] + c[2] - SimdDouble(2.0) * c[3]) * dot(m, em);
        const SimdDouble both = SimdDouble(2.0) * (c[3] - c[2]);
        const SimdMat3 fibre = outer(along * m, m) + symmetric_outer(both * m, em);
        for (int i = 0; i < 3; ++i)
            for (int k = i; k < 3; ++k)
                d[Green::at[i][k]] = SimdDouble(2.0) * c[2] * strain[Green::at[i][k]] + fibre.at[3 * i + k];
    }

    SimdDouble exponent(const SimdDouble c[]) const {  // Q = D : E / 2
        SimdDouble d[6];
        linear(c, e, d);
        return SimdDouble(0.5) * Green::double_dot(d, e);
    }
    SimdDouble growth(const SimdDouble c[]) const { return SimdDouble(0.5) * c[0] * exp(exponent(c)); }
};

}  // namespace magshell
