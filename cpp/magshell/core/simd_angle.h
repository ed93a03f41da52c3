// The angle of a unit vector in every lane of a SIMD vector, without a division.
#pragma once

#include <array>
#include <type_traits>

#include "magshell/core/simd_double.h"
#include "magshell/core/simd_float.h"

namespace magshell {

/// Returns atan2(sine, cosine) in every lane, given sine^2 + cosine^2 = 1; lanes are independent of each other.
///
/// The vector is turned by a half, a quarter, an eighth and a sixteenth turn, each where that brings it nearer to the axis. The angle x
/// that is left, of at most pi/16, is the series of asin: x = s + s^3/6 + 3/40 s^5 + ..., whose terms reach 1e-18 and 1e-8 of the sum.
template <class Value>
Value angle_of(const Value& sine, const Value& cosine) {
    using Lanes = decltype(Value{}.lanes);
    using Number = std::remove_cvref_t<decltype(Value{}.lanes[0])>;
    constexpr int terms = sizeof(Number) == sizeof(double) ? 11 : 4;
    const auto all = [](double number) { return Lanes{} + static_cast<Number>(number); };
    const Lanes zero = all(0.0);
    Lanes s = sine.lanes, c = cosine.lanes;
    const auto with_sign_of_s = [&](const Lanes& a) { return s < zero ? -a : a; };
    Lanes angle = c < zero ? with_sign_of_s(all(3.14159265358979312)) : zero;
    s = c < zero ? -s : s;
    c = c < zero ? -c : c;
    // Turns by the angle with this cosine and sine where |s| is more than that of half the angle.
    const auto turn = [&](double by, double cos, double sin, double sin_of_half) {
        const Lanes length = s < zero ? -s : s, signed_c = with_sign_of_s(c);
        const auto far = length > all(sin_of_half);
        angle += far ? with_sign_of_s(all(by)) : zero;
        s = far ? all(cos) * s - all(sin) * signed_c : s;
        c = far ? all(cos) * c + all(sin) * length : c;
    };
    turn(1.57079632679489656, 0.0, 1.0, 0.70710678118654752);
    turn(0.78539816339744828, 0.70710678118654752, 0.70710678118654752, 0.38268343236508977);
    turn(0.39269908169872414, 0.92387953251128676, 0.38268343236508977, 0.19509032201612827);
    constexpr auto coefficients = [] {  // (2n)! / (4^n (n!)^2 (2n + 1))
        std::array<double, terms> found{};
        double ratio = 1.0;
        for (int n = 1; n <= terms; ++n) {
            ratio *= (2.0 * n - 1.0) / (2.0 * n);
            found[n - 1] = ratio / (2.0 * n + 1.0);
        }
        return found;
    }();
    const Lanes z = s * s;
    Lanes sum = all(coefficients[terms - 1]);
    for (int n = terms - 2; n >= 0; --n) sum = sum * z + all(coefficients[n]);
    return Value(angle + (s + s * (z * sum)));
}

}  // namespace magshell
