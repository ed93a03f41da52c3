// SimdDouble: a SIMD vector of doubles. Each component (lane) belongs to one element, so one instruction of a kernel processes several
// elements: loops run over groups of SimdDouble::width elements.
//
// No operation combines lanes, so the result of an element does not depend on its neighbours in the SIMD vector. The implementation uses the vector
// extension of the compilers; -march selects the instructions.
#pragma once

#include <cmath>
#include <cstddef>

namespace magshell {

struct SimdDouble {
#if defined(__AVX512F__)
    static constexpr int width = 8;
#elif defined(__AVX__)
    static constexpr int width = 4;
#else
    static constexpr int width = 2;
#endif
    typedef double Lanes __attribute__((vector_size(width * sizeof(double))));

    Lanes lanes;

    SimdDouble() = default;
    SimdDouble(double value)
        : lanes(Lanes{} + value) {}  // NOLINT: a number in a formula is the same number in every lane
    explicit SimdDouble(Lanes l) : lanes(l) {}

    double operator[](int lane) const { return lanes[lane]; }
    void set(int lane, double value) { lanes[lane] = value; }

    SimdDouble& operator+=(const SimdDouble& b) {
        lanes += b.lanes;
        return *this;
    }
    SimdDouble& operator-=(const SimdDouble& b) {
        lanes -= b.lanes;
        return *this;
    }
    SimdDouble& operator*=(const SimdDouble& b) {
        lanes *= b.lanes;
        return *this;
    }

    friend SimdDouble operator+(const SimdDouble& a, const SimdDouble& b) {
        return SimdDouble(a.lanes + b.lanes);
    }
    friend SimdDouble operator-(const SimdDouble& a, const SimdDouble& b) {
        return SimdDouble(a.lanes - b.lanes);
    }
    friend SimdDouble operator*(const SimdDouble& a, const SimdDouble& b) {
        return SimdDouble(a.lanes * b.lanes);
    }
    friend SimdDouble operator/(const SimdDouble& a, const SimdDouble& b) {
        return SimdDouble(a.lanes / b.lanes);
    }
    friend SimdDouble operator-(const SimdDouble& a) { return SimdDouble(-a.lanes); }
};

inline SimdDouble sqrt(const SimdDouble& a) {
    SimdDouble root;
    for (int l = 0; l < SimdDouble::width; ++l) root.lanes[l] = std::sqrt(a.lanes[l]);
    return root;
}

inline SimdDouble abs(const SimdDouble& a) {
    SimdDouble magnitude;
    for (int l = 0; l < SimdDouble::width; ++l) magnitude.lanes[l] = std::abs(a.lanes[l]);
    return magnitude;
}

inline SimdDouble atan2(const SimdDouble& y, const SimdDouble& x) {
    SimdDouble angle;
    for (int l = 0; l < SimdDouble::width; ++l) angle.lanes[l] = std::atan2(y.lanes[l], x.lanes[l]);
    return angle;
}

}  // namespace magshell
