// A pack, i.e. a SIMD vector of doubles. Each component (lane) belongs to one element, so one instruction of a kernel processes several elements.
//
// No operation combines lanes, so the result of an element does not depend on its neighbours in the pack. The implementation uses the vector
// extension of the compilers; -march selects the instructions.
#pragma once

#include <cmath>
#include <cstddef>

namespace magshell {

struct Pack {
#if defined(__AVX512F__)
    static constexpr int width = 8;
#elif defined(__AVX__)
    static constexpr int width = 4;
#else
    static constexpr int width = 2;
#endif
    typedef double Lanes __attribute__((vector_size(width * sizeof(double))));

    Lanes lanes;

    Pack() = default;
    Pack(double value)
        : lanes(Lanes{} + value) {}  // NOLINT: a number in a formula is the same number in every lane
    explicit Pack(Lanes l) : lanes(l) {}

    double operator[](int lane) const { return lanes[lane]; }
    void set(int lane, double value) { lanes[lane] = value; }

    Pack& operator+=(const Pack& b) {
        lanes += b.lanes;
        return *this;
    }
    Pack& operator-=(const Pack& b) {
        lanes -= b.lanes;
        return *this;
    }
    Pack& operator*=(const Pack& b) {
        lanes *= b.lanes;
        return *this;
    }

    friend Pack operator+(const Pack& a, const Pack& b) { return Pack(a.lanes + b.lanes); }
    friend Pack operator-(const Pack& a, const Pack& b) { return Pack(a.lanes - b.lanes); }
    friend Pack operator*(const Pack& a, const Pack& b) { return Pack(a.lanes * b.lanes); }
    friend Pack operator/(const Pack& a, const Pack& b) { return Pack(a.lanes / b.lanes); }
    friend Pack operator-(const Pack& a) { return Pack(-a.lanes); }
};

inline Pack sqrt(const Pack& a) {
    Pack root;
    for (int l = 0; l < Pack::width; ++l) root.lanes[l] = std::sqrt(a.lanes[l]);
    return root;
}

inline Pack abs(const Pack& a) {
    Pack magnitude;
    for (int l = 0; l < Pack::width; ++l) magnitude.lanes[l] = std::abs(a.lanes[l]);
    return magnitude;
}

inline Pack atan2(const Pack& y, const Pack& x) {
    Pack angle;
    for (int l = 0; l < Pack::width; ++l) angle.lanes[l] = std::atan2(y.lanes[l], x.lanes[l]);
    return angle;
}

}  // namespace magshell
