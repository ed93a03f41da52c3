// Elementary functions of SIMD vectors, for kernels that need them: logarithm, exponential, cube root, and choices by lane.
#pragma once

#include <cmath>
#include <limits>
#include <utility>

#include "magshell/core/simd_double.h"

namespace magshell {

typedef unsigned long long LaneBits __attribute__((vector_size(sizeof(SimdDouble::Lanes))));

/// Returns a mask of the lanes whose bit is set.
inline auto lanes_with_bits(unsigned bits) {
    return [&]<std::size_t... lane>(std::index_sequence<lane...>) {
        return ((LaneBits{} + bits) & LaneBits{1ull << lane...}) != LaneBits{};
    }(std::make_index_sequence<SimdDouble::width>());
}

/// Returns the natural logarithm in every lane, to 1 ulp and with the special values of std::log; lanes are independent of each other.
///
///   a = 2^k m,  m in [1/sqrt 2, sqrt 2):   ln a = k ln 2 + ln(1 + f),  f = m - 1
///   ln(1 + f) = 2 atanh(s) = f - f^2/2 + s (f^2/2 + r),   s = f/(2 + f),  r = 2 sum_n s^2n/(2n + 1)
///
/// The series is the Taylor series: with |s| < 0.172, ten terms reach 1e-18 of the sum. ln 2 is split into two parts, the first with trailing
/// zeros so that its product with k is exact.
inline SimdDouble log(const SimdDouble& a) {
    using Lanes = SimdDouble::Lanes;
    const auto all = [](double number) { return Lanes{} + number; };
    constexpr unsigned long long mantissa = 0x000fffffffffffffull, one = 0x3ff0000000000000ull,
                                 root_half = 0x3fe6a09e667f3bcdull, exponent_zero = 0x4330000000000000ull;
    const auto denormal = a.lanes < all(0x1p-1022);
    const Lanes number = denormal ? a.lanes * all(0x1p54) : a.lanes;
    // Rounds the exponent so that the mantissa lies in [1/sqrt 2, sqrt 2) instead of [1, 2).
    const LaneBits bits = LaneBits(number) + (one - root_half);
    const LaneBits exponent_bits = (bits >> 52) | exponent_zero, m_bits = (bits & mantissa) + root_half;
    const Lanes k = Lanes(exponent_bits) - (denormal ? all(0x1p52 + 1077) : all(0x1p52 + 1023)),
                f = Lanes(m_bits) - all(1.0);
    const Lanes s = f / (all(2.0) + f), z = s * s, half_square = all(0.5) * f * f;
    Lanes r = all(2.0 / 21.0);
    for (int n = 9; n >= 1; --n) r = r * z + all(2.0 / (2 * n + 1));
    r = r * z;
    constexpr double ln2_high = 0x1.62e42fee00000p-1, ln2_low = 0x1.a39ef35793c76p-33;
    const Lanes result = k * all(ln2_high) - ((half_square - (s * (half_square + r) + k * all(ln2_low))) - f);
    const Lanes infinity = all(std::numeric_limits<double>::infinity()),
                nan = all(std::numeric_limits<double>::quiet_NaN());
    const Lanes with_ends = a.lanes == infinity ? infinity : a.lanes == all(0.0) ? -infinity : nan;
    return SimdDouble((a.lanes > all(0.0)) & (a.lanes < infinity) ? result : with_ends);
}

inline SimdDouble exp(const SimdDouble& a) {
    SimdDouble result;
    for (int l = 0; l < SimdDouble::width; ++l) result.lanes[l] = std::exp(a.lanes[l]);
    return result;
}

inline SimdDouble cbrt(const SimdDouble& a) {
    SimdDouble result;
    for (int l = 0; l < SimdDouble::width; ++l) result.lanes[l] = std::cbrt(a.lanes[l]);
    return result;
}

inline SimdDouble max(const SimdDouble& a, const SimdDouble& b) {
    return SimdDouble(a.lanes > b.lanes ? a.lanes : b.lanes);
}

/// Returns a in lanes in which `number` is negative, else b.
inline SimdDouble where_negative(const SimdDouble& number, const SimdDouble& a, const SimdDouble& b) {
    return SimdDouble(number.lanes < SimdDouble(0.0).lanes ? a.lanes : b.lanes);
}

}  // namespace magshell
