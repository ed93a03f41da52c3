// Dense matrices in slabs: eight rows side by side, column after column.
//
// Eight doubles are one vector register (two or four on older processors), so a slab is already the "packed"
// operand of a matrix product. The factor is stored, multiplied and solved with in this one layout and never
// repacked.
#pragma once

#include <cstddef>
#include <cstring>
#include <memory>

#include "magshell/core/large_memory.h"
#include "magshell/core/types.h"

namespace magshell::slabs {

inline constexpr Index width = 8;  // [rows] of a slab; one vector register of doubles, plain-words: ok

// The widest vector of the processor. Everything that depends on it is in an inline namespace with the family's
// name, because a wheel contains some of it for two families (dense_kernels.h).
#if defined(__AVX512F__)
#define MAGSHELL_FAMILY avx512
#elif defined(__AVX__)
#define MAGSHELL_FAMILY avx
#else
#define MAGSHELL_FAMILY baseline
#endif

inline namespace MAGSHELL_FAMILY {

#if defined(__AVX512F__)
inline constexpr int native_bytes = 64;  // [bytes] of a vector register; plain-words: ok
#elif defined(__AVX__)
inline constexpr int native_bytes = 32;  // [bytes] of a vector register; plain-words: ok
#else
inline constexpr int native_bytes = 16;  // [bytes] of a vector register; plain-words: ok
#endif
using Native [[gnu::vector_size(native_bytes), gnu::may_alias]] = double;

/// Eight doubles, 64-byte aligned: one, two or four registers. (GCC keeps vectors wider than a register in
/// memory, so they are written out.)
struct [[gnu::may_alias]] alignas(64) Lanes {
    static constexpr int natives = 64 / native_bytes;  // registers; plain-words: ok
    Native part[natives];

    double& operator[](Index lane) { return reinterpret_cast<double*>(part)[lane]; }
    double operator[](Index lane) const { return reinterpret_cast<const double*>(part)[lane]; }

    /// Sets this = f(this, other), register by register.
    template <class F>
    [[gnu::always_inline]] Lanes& apply(const Lanes& other, F&& f) {
#pragma GCC unroll 4
        for (int n = 0; n < natives; ++n) part[n] = f(part[n], other.part[n]);
        return *this;
    }
    [[gnu::always_inline]] Lanes& operator+=(const Lanes& b) {
        return apply(b, [](const Native& x, const Native& y) -> Native { return x + y; });
    }
    [[gnu::always_inline]] Lanes& operator-=(const Lanes& b) {
        return apply(b, [](const Native& x, const Native& y) -> Native { return x - y; });
    }
    [[gnu::always_inline]] Lanes& operator*=(const Lanes& b) {
        return apply(b, [](const Native& x, const Native& y) -> Native { return x * y; });
    }
    [[gnu::always_inline]] Lanes& operator*=(double b) {
        return apply(*this, [b](const Native& x, const Native&) -> Native { return x * b; });
    }
    [[gnu::always_inline]] Lanes& operator/=(double b) {
        return apply(*this, [b](const Native& x, const Native&) -> Native { return x / b; });
    }
    /// Sets this = max(this, |other|).
    [[gnu::always_inline]] void raise_to_magnitude(const Lanes& b) {
        apply(b, [](const Native& x, const Native& y) -> Native {
            const Native magnitude = y < 0.0 ? -y : y;
            return magnitude > x ? magnitude : x;
        });
    }
    [[gnu::always_inline]] friend Lanes operator+(const Lanes& a, const Lanes& b) { return Lanes(a) += b; }
    [[gnu::always_inline]] friend Lanes operator-(const Lanes& a, const Lanes& b) { return Lanes(a) -= b; }
    [[gnu::always_inline]] friend Lanes operator*(const Lanes& a, const Lanes& b) { return Lanes(a) *= b; }
    [[gnu::always_inline]] friend Lanes operator*(const Lanes& a, double b) { return Lanes(a) *= b; }
    [[gnu::always_inline]] friend Lanes operator/(const Lanes& a, double b) { return Lanes(a) /= b; }
};

inline Lanes& lanes(double* at) {
    return *reinterpret_cast<Lanes*>(at);
}
inline const Lanes& lanes(const double* at) {
    return *reinterpret_cast<const Lanes*>(at);
}

}  // namespace MAGSHELL_FAMILY

inline constexpr Index count(Index rows) {
    return (rows + width - 1) / width;
}

/// A lower triangle: slab i holds the columns 0 ... 8 i + 7, the last eight of which contain the diagonal.
struct Triangle {
    double* data;
    double* slab(Index i) const { return data + offset(i); }
    static constexpr std::ptrdiff_t offset(Index i) { return 32 * std::ptrdiff_t{i} * (i + 1); }
    /// Returns the doubles taken by a triangle of this many rows whose columns end at its last row.
    static constexpr std::ptrdiff_t doubles(Index rows) {
        return rows == 0 ? 0 : offset(count(rows) - 1) + std::ptrdiff_t{width} * rows;
    }
};

/// A rectangle: full rows with a given number of columns.
struct Rectangle {
    double* data;
    Index columns;
    double* slab(Index i) const { return data + std::ptrdiff_t{width} * columns * i; }
    static constexpr std::ptrdiff_t doubles(Index rows, Index columns) {
        return std::ptrdiff_t{width} * columns * count(rows);
    }
};

/// The eliminated columns of a front: the pivots' own rows on top (a triangle), the other rows below (a
/// rectangle).
struct Panel {
    Triangle top;
    Rectangle below;
    Index top_slabs;

    Panel(double* data, Index pivots)
        : top{data}, below{data + Triangle::doubles(pivots), pivots}, top_slabs(count(pivots)) {}
    double* slab(Index i) const { return i < top_slabs ? top.slab(i) : below.slab(i - top_slabs); }
    static constexpr std::ptrdiff_t doubles(Index pivots, Index rows_below) {
        return Triangle::doubles(pivots) + Rectangle::doubles(rows_below, pivots);
    }
};

/// Aligned, uninitialized memory: pages are touched first by the thread that fills them.
class Buffer {
  public:
    Buffer() = default;
    explicit Buffer(std::ptrdiff_t doubles)
        : size_(doubles), data_(static_cast<double*>(take_memory(sizeof(double) * doubles)), {doubles}) {}
    double* data() const { return data_.get(); }
    std::ptrdiff_t size() const { return size_; }

  private:
    struct GiveBack {
        std::ptrdiff_t doubles;
        void operator()(double* data) const { give_back_memory(data, sizeof(double) * doubles); }
    };
    std::ptrdiff_t size_ = 0;
    std::unique_ptr<double, GiveBack> data_;
};

}  // namespace magshell::slabs
