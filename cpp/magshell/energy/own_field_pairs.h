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

#include <vector>

#include "magshell/core/dual.h"
#include "magshell/core/simd_double.h"

namespace magshell {

/// [m] SamplePoint of sources without strength, so that their distance is not zero.
inline constexpr double far_away = 1e30;

/// Returns 1 / sqrt(a), to an error of a few units in the last place, for normal numbers.
inline SimdDouble inverse_root(const SimdDouble& a) {
#if defined(__AVX512F__)
    // An estimate of 14 bits and two steps of Newton's method take a quarter of the time of a division by a root.
    SimdDouble y(static_cast<SimdDouble::Lanes>(_mm512_rsqrt14_pd(a.lanes)));
    const SimdDouble half = SimdDouble(0.5) * a, more(1.5);
    y *= more - half * y * y;
    y *= more - half * y * y;
    return y;
#else
    return SimdDouble(1.0) / sqrt(a);
#endif
}

/// A source point, or the sums at a point.
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
