// SimdFloat: a SIMD vector of single-precision numbers, with twice the lanes of a SimdDouble, for sums of low accuracy.
#pragma once

#include "magshell/core/simd_double.h"

namespace magshell {

struct SimdFloat {
    static constexpr int width = 2 * SimdDouble::width;
    typedef float Lanes __attribute__((vector_size(width * sizeof(float))));

    Lanes lanes;

    SimdFloat() = default;
    SimdFloat(float value)
        : lanes(Lanes{} + value) {}  // NOLINT: a number in a formula is the same number in every lane
    explicit SimdFloat(Lanes l) : lanes(l) {}

    float operator[](int lane) const { return lanes[lane]; }
    void set(int lane, double value) { lanes[lane] = static_cast<float>(value); }

    SimdFloat& operator+=(const SimdFloat& b) {
        lanes += b.lanes;
        return *this;
    }
    SimdFloat& operator-=(const SimdFloat& b) {
        lanes -= b.lanes;
        return *this;
    }
    friend SimdFloat operator+(const SimdFloat& a, const SimdFloat& b) {
        return SimdFloat(a.lanes + b.lanes);
    }
    friend SimdFloat operator-(const SimdFloat& a, const SimdFloat& b) {
        return SimdFloat(a.lanes - b.lanes);
    }
    friend SimdFloat operator*(const SimdFloat& a, const SimdFloat& b) {
        return SimdFloat(a.lanes * b.lanes);
    }
    friend SimdFloat operator-(const SimdFloat& a) { return SimdFloat(-a.lanes); }
};

}  // namespace magshell
