// DualLanes: a dual number in each lane of a SIMD vector; and LanesOf<T>: the lanes of numbers or of dual numbers, loaded from arrays of
// values and of rates.
#pragma once

#include <cstring>

#include "magshell/core/dual.h"
#include "magshell/core/simd_double.h"

namespace magshell {

template <class Lanes>
struct DualLanes {
    Lanes value{}, rate{};

    DualLanes() = default;
    DualLanes(const Lanes& v, const Lanes& r) : value(v), rate(r) {}
    DualLanes& operator+=(const DualLanes& b) {
        value += b.value;
        rate += b.rate;
        return *this;
    }
    DualLanes& operator-=(const DualLanes& b) {
        value -= b.value;
        rate -= b.rate;
        return *this;
    }
    friend DualLanes operator+(const DualLanes& a, const DualLanes& b) {
        return {a.value + b.value, a.rate + b.rate};
    }
    friend DualLanes operator-(const DualLanes& a, const DualLanes& b) {
        return {a.value - b.value, a.rate - b.rate};
    }
    friend DualLanes operator-(const DualLanes& a) { return {-a.value, -a.rate}; }
    friend DualLanes operator*(const DualLanes& a, const DualLanes& b) {
        return {a.value * b.value, a.rate * b.value + a.value * b.rate};
    }
    friend DualLanes operator*(const Lanes& a, const DualLanes& b) { return {a * b.value, a * b.rate}; }
};
using SimdDual = DualLanes<SimdDouble>;

/// Returns the sum of all lanes, in their order.
inline double sum_of_lanes(const SimdDouble& a) {
    double sum = 0.0;
    for (int lane = 0; lane < SimdDouble::width; ++lane) sum += a[lane];
    return sum;
}

template <class T>
struct LanesOf {
    using Type = SimdDouble;
    static Type load(const double* values, const double*) {
        SimdDouble out;
        std::memcpy(&out.lanes, values, sizeof out.lanes);
        return out;
    }
    static Type broadcast(const double* values, const double*) { return SimdDouble(*values); }
    static T sum(const Type& a) { return sum_of_lanes(a); }
    static Type zero() { return SimdDouble(0.0); }
    static Type one() { return SimdDouble(1.0); }
    static void set(Type& a, int lane, double b) { a.set(lane, b); }
    static T lane(const Type& a, int lane) { return a[lane]; }
};

template <>
struct LanesOf<Dual> {
    using Type = SimdDual;
    static Type load(const double* values, const double* rates) {
        return {LanesOf<double>::load(values, nullptr), LanesOf<double>::load(rates, nullptr)};
    }
    static Type broadcast(const double* values, const double* rates) {
        return {SimdDouble(*values), SimdDouble(*rates)};
    }
    static Dual sum(const Type& a) { return {sum_of_lanes(a.value), sum_of_lanes(a.rate)}; }
    static Type zero() { return {}; }
    static Type one() { return {SimdDouble(1.0), SimdDouble(0.0)}; }
    static void set(Type& a, int lane, const Dual& b) {
        a.value.set(lane, b.value);
        a.rate.set(lane, b.rate);
    }
    static Dual lane(const Type& a, int lane) { return {a.value[lane], a.rate[lane]}; }
};

}  // namespace magshell
