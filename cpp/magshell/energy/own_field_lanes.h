// Lanes of sums over near pairs of an OwnField (energy/own_field.h): one pair in each lane, with numbers, with dual numbers, or with dual
// numbers in single precision for products that need few digits.
#pragma once

#if defined(__AVX512F__)
#include <immintrin.h>
#endif

#include <cstring>
#include <type_traits>

#include "magshell/core/dual.h"
#include "magshell/core/simd_float.h"
#include "magshell/energy/own_field_geometry.h"
#include "magshell/energy/simd_dual.h"

namespace magshell {
namespace own_field {

/// Returns 1 / sqrt(a) to an error of 1e-5.
inline SimdFloat inverse_root(const SimdFloat& a) {
    // An estimate, and a step as in the function for SimdDouble.
    SimdFloat y;
#if defined(__AVX512F__)
    y = SimdFloat(static_cast<SimdFloat::Lanes>(_mm512_rsqrt14_ps(a.lanes)));
    return y * (SimdFloat(1.5f) - SimdFloat(0.5f) * a * y * y);
#else
    typedef unsigned Integers __attribute__((vector_size(sizeof(SimdFloat::Lanes))));
    Integers bits;
    std::memcpy(&bits, &a.lanes, sizeof bits);
    bits = (Integers{} + 0x5f375a86u) - (bits >> 1);
    std::memcpy(&y.lanes, &bits, sizeof bits);
    const SimdFloat e = SimdFloat(1.0f) - a * y * y;
    return y + (e * y) * (SimdFloat(0.5f) + e * (SimdFloat(0.375f) + SimdFloat(0.3125f) * e));
#endif
}

template <class Value>
DualLanes<Value> inverse_root(const DualLanes<Value>& a) {
    const Value root = inverse_root(a.value);
    return {root, Value(-0.5f) * (root * root * root) * a.rate};
}

/// Returns a SIMD vector with the same number in every lane; the compiler loads and copies it in one instruction.
template <class Value, class Number>
Value in_all_lanes(Number number) {
    return Value(number - typename Value::Lanes{});
}

/// Returns a number between zero and one in every lane: the nearest one.
template <class Value>
Value clamped(const Value& a) {
    const auto zero = Value(0.0f).lanes, one = Value(1.0f).lanes;
    const auto raised = a.lanes < zero ? zero : a.lanes;
    return Value(raised > one ? one : raised);
}

// The weight of the near value of a pair and its derivatives with respect to t: 1 up to `near`, 0 from `far` on, with continuous second
// derivatives.
template <class Value>
struct BlendWeight {
    Value value, slope, curvature;
};
template <class Value>
BlendWeight<Value> blend(const Blend& range, const Value& t) {
    using Number = std::remove_cvref_t<decltype(Value{}.lanes[0])>;
    const auto all = [](double a) { return Value(static_cast<Number>(a)); };
    const double density = 1.0 / (range.far - range.near);
    const Value s = clamped(all(density) * (all(range.far) - t)), left = all(1.0) - s;
    return {s * s * s * (all(10.0) - all(15.0) * s + all(6.0) * s * s),
            all(-30.0 * density) * s * s * left * left,
            all(60.0 * density * density) * s * left * (all(1.0) - all(2.0) * s)};
}

// Converts the weight and its slope to lanes of the type of t: numbers, or dual numbers.
template <class Value>
void lift(const Blend& range, const Value& t, Value& value, Value& slope) {
    const BlendWeight<Value> weight = blend(range, t);
    value = weight.value;
    slope = weight.slope;
}
template <class Value>
void lift(const Blend& range, const DualLanes<Value>& t, DualLanes<Value>& value, DualLanes<Value>& slope) {
    const BlendWeight<Value> weight = blend(range, t.value);
    value = {weight.value, weight.slope * t.rate};
    slope = {weight.slope, weight.curvature * t.rate};
}

/// The units of rates and charges in lanes, so that single precision suffices.
struct Units {
    double rate = 1.0, charge = 1.0, face = 1.0;  // face: of currents and charges of faces
};

/// Returns units for products that need few digits: the largest ones.
template <class T>
Units units_of(const std::vector<Triple<T>>& x, const std::vector<ElementPose<T>>& elements,
               const std::vector<FacePose<T>>& faces) {
    Units largest{0.0, 0.0, 0.0};
    for (const Triple<T>& each : x)
        largest.rate = std::max(largest.rate, rates_of(each).cwiseAbs().maxCoeff());
    for (const ElementPose<T>& each : elements)
        largest.charge = std::max(
            {largest.charge, std::abs(value_of(each.charge)), std::abs(value_of(each.current)) * each.size});
    for (const FacePose<T>& each : faces)
        largest.face =
            std::max({largest.face, std::abs(value_of(each.current)), std::abs(each.charge) / each.size});
    for (double* const each : {&largest.rate, &largest.charge, &largest.face})
        if (*each == 0.0) *each = 1.0;
    return largest;
}

/// The numbers of a pair in each lane.
template <class T, class V>
struct PairLanes {
    using Value = V;
    using Lanes = std::conditional_t<std::is_same_v<T, Dual>, DualLanes<Value>, Value>;
    using Number = std::remove_cvref_t<decltype(Value{}.lanes[0])>;
    static constexpr int width = Value::width;

    static Number number(double a) { return static_cast<Number>(a); }
    static void set(Lanes& a, int lane, const T& b) {
        if constexpr (std::is_same_v<T, Dual>) {
            a.value.set(lane, b.value);
            a.rate.set(lane, b.rate);
        } else {
            a.set(lane, b);
        }
    }
    static void set(Triple<Lanes>& a, int lane, const Triple<T>& b) {
        set(a.x, lane, b.x);
        set(a.y, lane, b.y);
        set(a.z, lane, b.z);
    }
    static T get(const Lanes& a, int lane) {
        if constexpr (std::is_same_v<T, Dual>)
            return {a.value[lane], a.rate[lane]};
        else
            return a[lane];
    }
    static Triple<T> get(const Triple<Lanes>& a, int lane) {
        return {get(a.x, lane), get(a.y, lane), get(a.z, lane)};
    }
    static Triple<Lanes> scaled(const Value& factor, const Triple<Lanes>& a) {
        return {factor * a.x, factor * a.y, factor * a.z};
    }
    static void add_scaled(const Value& factor, const Triple<Lanes>& more, Triple<Lanes>& out) {
        out.x += factor * more.x;
        out.y += factor * more.y;
        out.z += factor * more.z;
    }
};

}  // namespace own_field
}  // namespace magshell
