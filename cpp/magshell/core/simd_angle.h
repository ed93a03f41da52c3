// The angle of a unit vector in every lane of a SIMD vector, without a division.
#pragma once

#include <array>
#include <type_traits>

#include "magshell/core/simd_double.h"
#include "magshell/core/simd_float.h"

namespace magshell {

/// Returns atan2(sine, cosine) in every lane, given sine^2 + cosine^2 = 1; lanes are independent of each other.
///
/// The vector is mirrored into the first eighth of the circle, and turned back by 0, pi/8 or pi/4. The angle that is left, of at most pi/16,
/// is the series of asin: s + s^3/6 + 3/40 s^5 + ..., whose terms reach 1e-17 and 1e-8 of the sum.
template <class Value>
Value angle_of(const Value& sine, const Value& cosine) {
    using Lanes = typename Value::Lanes;
    using Number = std::remove_cvref_t<decltype(Value{}.lanes[0])>;
    using Bits = decltype(Lanes{} < Lanes{});
    constexpr int terms = sizeof(Number) == sizeof(double) ? 10 : 4;
    const auto all = [](double number) { return Lanes{} + static_cast<Number>(number); };
    const Bits sign_bit = Bits(-Lanes{});
    const Lanes s = Lanes(Bits(sine.lanes) & ~sign_bit), c = Lanes(Bits(cosine.lanes) & ~sign_bit);
    const auto steep = s > c;
    const Lanes lower = steep ? c : s, upper = steep ? s : c;
    const auto second = lower > all(0.19509032201612825), third = lower > all(0.55557023301960218);
    const Lanes turned_cos = third ? all(0.70710678118654752) : second ? all(0.92387953251128676) : all(1.0);
    const Lanes turned_sin = third ? all(0.70710678118654752) : second ? all(0.38268343236508977) : all(0.0);
    const Lanes turned = third ? all(0.78539816339744831) : second ? all(0.39269908169872415) : all(0.0);
    const Lanes left = turned_cos * lower - turned_sin * upper, z = left * left;
    constexpr auto coefficients = [] {  // (2n)! / (4^n (n!)^2 (2n + 1))
        std::array<double, terms> found{};
        double ratio = 1.0;
        for (int n = 1; n <= terms; ++n) {
            ratio *= (2.0 * n - 1.0) / (2.0 * n);
            found[n - 1] = ratio / (2.0 * n + 1.0);
        }
        return found;
    }();
    Lanes sum = all(coefficients[terms - 1]);
    for (int n = terms - 2; n >= 0; --n) sum = sum * z + all(coefficients[n]);
    Lanes angle = turned + (left + left * (z * sum));
    angle = steep ? all(1.57079632679489662) - angle : angle;
    angle = cosine.lanes < all(0.0) ? all(3.14159265358979324) - angle : angle;
    return Value(Lanes(Bits(angle) | (Bits(sine.lanes) & sign_bit)));
}

}  // namespace magshell
