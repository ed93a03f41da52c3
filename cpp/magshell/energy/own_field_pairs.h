// Sums over pairs of magnetic source points: charges q [A m] and current elements c [A m] at points p, which interact with
//
//   E = mu_0/(4 pi) 1/2 sum_{i != j} (q_i q_j - c_i . c_j) / |p_i - p_j|                                        [J]
//
// This file adds up the potentials and the force of all sources at one point, for numbers and for dual numbers. Lanes of a SIMD vector
// are successive sources, whose shares are added in a fixed order at the end, so that results do not depend on threads.
#pragma once

#if defined(__AVX512F__)
#include <immintrin.h>
#endif

#include <array>
#include <cstring>
#include <vector>

#include "magshell/core/dual.h"
#include "magshell/core/simd_double.h"

namespace magshell {

/// [m] SamplePoint of sources without strength, so that their distance is not zero.
inline constexpr double far_away = 1e30;

/// Returns 1 / sqrt(a), to an error of a few units in the last place, for normal numbers.
inline SimdDouble inverse_root(const SimdDouble& a) {
    // y / sqrt(1 - e) = y (1 + e/2 + 3/8 e^2 + 5/16 e^3 + ...) with the defect e = 1 - a y^2 of an estimate y: each such step takes the
    // fourth power of the error, in less time than a division by a root.
    const auto improved = [&](const SimdDouble& y) {
        const SimdDouble e = SimdDouble(1.0) - a * y * y;
        return y + (e * y) * (SimdDouble(0.5) + e * (SimdDouble(0.375) + SimdDouble(0.3125) * e));
    };
#if defined(__AVX512F__)
    return improved(SimdDouble(static_cast<SimdDouble::Lanes>(_mm512_rsqrt14_pd(a.lanes))));
#else
    // Half of the exponent, and a line through the mantissas: an error of 3.5 % at most [Lomont 2003].
    typedef unsigned long long Integers __attribute__((vector_size(sizeof(SimdDouble::Lanes))));
    Integers bits;
    std::memcpy(&bits, &a.lanes, sizeof bits);
    bits = (Integers{} + 0x5fe6eb50c7b537a9ull) - (bits >> 1);
    SimdDouble y;
    std::memcpy(&y.lanes, &bits, sizeof bits);
    return improved(improved(y));
#endif
}

/// A source point.
template <class T>
struct SourcePoint {
    Triple<T> at;       // p [m]
    T charge{};         // q [A m]
    Triple<T> current;  // c [A m2]
};

/// The sums over all sources j, for a point p with charge q and current element c:
/// charges sum q_j / r, currents sum c_j / r, and pull sum (q q_j - c . c_j) (p - p_j) / r^3, with r = |p - p_j|.
template <class T>
struct SourceSums {
    T charges{};
    Triple<T> currents, pull;
};

/// Source points in one array per component, for SIMD loads. Rates are stored only for dual numbers.
class SourceArrays {
  public:
    /// Makes room for `count` points; missing lanes of the last SIMD vector have no strength.
    void resize(std::size_t count, bool has_currents, bool has_rates);
    std::size_t size() const { return count_; }

    template <class T>
    void set(std::size_t k, const SourcePoint<T>& point);
    /// Takes the points of these ranges of others, one after another.
    void gather(const SourceArrays& from, const std::vector<std::array<std::size_t, 2>>& ranges);

    /// Adds the sums over the sources [first, last) except those in [skip, skip_end), which may coincide with the point.
    template <class T>
    void add_sums(const SourcePoint<T>& point, std::size_t first, std::size_t last, std::size_t skip,
                  std::size_t skip_end, SourceSums<T>& out) const;

  private:
    static constexpr int components = 7;  // x, y, z, q, c_x, c_y, c_z

    template <bool has_currents>
    void add(const SourcePoint<double>& point, std::size_t first, std::size_t last, std::size_t skip,
             std::size_t skip_end, SourceSums<double>& out) const;
    template <bool has_currents>
    void add(const SourcePoint<Dual>& point, std::size_t first, std::size_t last, std::size_t skip,
             std::size_t skip_end, SourceSums<Dual>& out) const;

    std::size_t count_ = 0;
    bool has_currents_ = false;
    std::vector<double> values_[components], rates_[components];
};

}  // namespace magshell
