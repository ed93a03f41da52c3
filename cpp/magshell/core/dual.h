// Dual: a number with its rate along one direction, for forward differentiation. A gradient that is computed with dual numbers has the
// product of the Hessian with the direction as its rate. Triple<T> is a vector of three numbers or dual numbers.
#pragma once

#include <cmath>

#include "magshell/core/types.h"

namespace magshell {

struct Dual {
    double value = 0.0, rate = 0.0;

    Dual() = default;
    Dual(double v, double r = 0.0) : value(v), rate(r) {}  // NOLINT: a number in a formula has no rate

    Dual& operator+=(const Dual& b) {
        value += b.value;
        rate += b.rate;
        return *this;
    }
    Dual& operator-=(const Dual& b) {
        value -= b.value;
        rate -= b.rate;
        return *this;
    }
    friend Dual operator+(const Dual& a, const Dual& b) { return {a.value + b.value, a.rate + b.rate}; }
    friend Dual operator-(const Dual& a, const Dual& b) { return {a.value - b.value, a.rate - b.rate}; }
    friend Dual operator-(const Dual& a) { return {-a.value, -a.rate}; }
    friend Dual operator*(const Dual& a, const Dual& b) {
        return {a.value * b.value, a.rate * b.value + a.value * b.rate};
    }
    friend Dual operator/(const Dual& a, const Dual& b) {
        const double quotient = a.value / b.value;
        return {quotient, (a.rate - quotient * b.rate) / b.value};
    }
};

inline Dual sqrt(const Dual& a) {
    const double root = std::sqrt(a.value);
    return {root, a.rate / (2.0 * root)};
}

inline Dual log(const Dual& a) {
    return {std::log(a.value), a.rate / a.value};
}

inline Dual atan2(const Dual& y, const Dual& x) {
    return {std::atan2(y.value, x.value),
            (y.rate * x.value - x.rate * y.value) / (x.value * x.value + y.value * y.value)};
}

inline double value_of(double a) {
    return a;
}
inline double value_of(const Dual& a) {
    return a.value;
}
inline double rate_of(double) {
    return 0.0;
}
inline double rate_of(const Dual& a) {
    return a.rate;
}

template <class T>
struct Triple {
    T x{}, y{}, z{};

    Triple& operator+=(const Triple& b) {
        x += b.x;
        y += b.y;
        z += b.z;
        return *this;
    }
    Triple& operator-=(const Triple& b) {
        x -= b.x;
        y -= b.y;
        z -= b.z;
        return *this;
    }
    friend Triple operator+(const Triple& a, const Triple& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend Triple operator-(const Triple& a, const Triple& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend Triple operator-(const Triple& a) { return {-a.x, -a.y, -a.z}; }
    friend Triple operator*(const T& s, const Triple& a) { return {s * a.x, s * a.y, s * a.z}; }
};

template <class T>
T dot(const Triple<T>& a, const Triple<T>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class T>
Triple<T> cross(const Triple<T>& a, const Triple<T>& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

template <class T>
T norm(const Triple<T>& a) {
    using std::sqrt;
    return sqrt(dot(a, a));
}

template <class T>
Vec3 values_of(const Triple<T>& a) {
    return {value_of(a.x), value_of(a.y), value_of(a.z)};
}
template <class T>
Vec3 rates_of(const Triple<T>& a) {
    return {rate_of(a.x), rate_of(a.y), rate_of(a.z)};
}

}  // namespace magshell
