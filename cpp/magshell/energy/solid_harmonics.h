// Solid harmonics up to a degree, for a place in each lane:
//
//   R_l^m(r) = r^l P_l^m(cos theta) e^(i m phi) / (l + m)!       I_l^m(r) = (l - m)! P_l^m(cos theta) e^(i m phi) / r^(l+1)
//
// with P_l^m without the factor (-1)^m, so that R_1^1 = (x + i y) / 2. For m < 0 both are (-1)^m times the conjugate of those for -m.
// Sums over all l and -l <= m <= l, and over k and n where the harmonics exist [Epton95]:
//
//   1/|a - b|   = sum conj R_l^m(b) I_l^m(a),   |b| < |a|
//   R_l^m(a + b) = sum R_k^n(a) R_(l-k)^(m-n)(b)
//   I_l^m(a + b) = sum (-1)^k conj R_k^n(b) I_(l+k)^(m+n)(a),   |b| < |a|
#pragma once

#include <vector>

#include "magshell/energy/own_field_pairs.h"
#include "magshell/energy/simd_dual.h"

namespace magshell {

template <class Lanes>
struct ComplexLanes {
    Lanes re, im;
};

/// Returns the number of pairs (l, m) with 0 <= m <= l <= degree.
constexpr int harmonic_count(int degree) {
    return (degree + 1) * (degree + 2) / 2;
}
/// Returns the number of (l, m) among those with 0 <= m <= l.
constexpr int half_index(int l, int m) {
    return l * (l + 1) / 2 + m;
}
/// Returns the number of (l, m) among those with -l <= m <= l.
constexpr int full_index(int l, int m) {
    return l * (l + 1) + m;
}

/// Sets R_l^m(r) for 0 <= m <= l <= degree.
template <class Lanes>
void set_regular_harmonics(int degree, const Triple<Lanes>& r, const Lanes& one, const Lanes& zero,
                           ComplexLanes<Lanes>* out) {
    const Lanes squared = dot(r, r);
    for (int m = 0; m <= degree; ++m) {
        ComplexLanes<Lanes>& first = out[half_index(m, m)];
        if (m == 0) {
            first = {one, zero};
        } else {
            const ComplexLanes<Lanes>& last = out[half_index(m - 1, m - 1)];
            const SimdDouble part(0.5 / m);
            first = {part * (r.x * last.re - r.y * last.im), part * (r.x * last.im + r.y * last.re)};
        }
        if (m == degree) continue;
        out[half_index(m + 1, m)] = {r.z * first.re, r.z * first.im};
        for (int l = m + 2; l <= degree; ++l) {
            const double factor = 1.0 / ((l + m) * (l - m));
            const Lanes along = SimdDouble((2 * l - 1) * factor) * r.z, back = SimdDouble(factor) * squared;
            const ComplexLanes<Lanes>&last = out[half_index(l - 1, m)], &before = out[half_index(l - 2, m)];
            out[half_index(l, m)] = {along * last.re - back * before.re, along * last.im - back * before.im};
        }
    }
}

/// Complex numbers for -l <= m <= l <= degree in each lane, where those for -m are (-1)^m times the conjugate of those for m.
class FullHarmonics {
  public:
    /// One number more than needed: sums of two successive m load it.
    explicit FullHarmonics(int degree)
        : degree_(degree), numbers_(full_index(degree, degree) + 2, {SimdDouble(0.0), SimdDouble(0.0)}) {}

    const ComplexLanes<SimdDouble>& operator()(int l, int m) const { return numbers_[full_index(l, m)]; }
    const ComplexLanes<SimdDouble>* data() const { return numbers_.data(); }

    /// Sets the number for (l, m) and that for (l, -m).
    void set(int l, int m, const ComplexLanes<SimdDouble>& number) {
        numbers_[full_index(l, -m)] = m % 2 == 0 ? ComplexLanes<SimdDouble>{number.re, -number.im}
                                                 : ComplexLanes<SimdDouble>{-number.re, number.im};
        numbers_[full_index(l, m)] = number;
    }
    void set(const ComplexLanes<SimdDouble>* half) {
        for (int l = 0; l <= degree_; ++l)
            for (int m = 0; m <= l; ++m) set(l, m, half[half_index(l, m)]);
    }
    /// Sets conj R_l^m(r). half: harmonic_count(degree) numbers to work in.
    void set_conjugate_regular(const Triple<SimdDouble>& r, std::vector<ComplexLanes<SimdDouble>>& half) {
        set_regular_harmonics(degree_, r, SimdDouble(1.0), SimdDouble(0.0), half.data());
        for (ComplexLanes<SimdDouble>& each : half) each.im = -each.im;
        set(half.data());
    }
    /// Sets I_l^m(r).
    void set_irregular(const Triple<SimdDouble>& r) {
        const SimdDouble inverse = inverse_root(dot(r, r)), squared = inverse * inverse;
        const SimdDouble x = squared * r.x, y = squared * r.y, z = squared * r.z;
        for (int m = 0; m <= degree_; ++m) {
            if (m == 0) {
                set(0, 0, {inverse, SimdDouble(0.0)});
            } else {
                const ComplexLanes<SimdDouble>& last = (*this)(m - 1, m - 1);
                const SimdDouble factor(2 * m - 1);
                set(m, m, {factor * (x * last.re - y * last.im), factor * (x * last.im + y * last.re)});
            }
            for (int l = m + 1; l <= degree_; ++l) {
                const SimdDouble along = SimdDouble(2 * l - 1) * z;
                const ComplexLanes<SimdDouble>& last = (*this)(l - 1, m);
                ComplexLanes<SimdDouble> next{along * last.re, along * last.im};
                if (l > m + 1) {
                    const SimdDouble back = SimdDouble((l - 1) * (l - 1) - m * m) * squared;
                    const ComplexLanes<SimdDouble>& before = (*this)(l - 2, m);
                    next.re -= back * before.re;
                    next.im -= back * before.im;
                }
                set(l, m, next);
            }
        }
    }

  private:
    int degree_;
    std::vector<ComplexLanes<SimdDouble>> numbers_;
};

}  // namespace magshell
