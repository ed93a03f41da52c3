// The sums of energy/own_field_near_pairs.h for pairs of edges, one pair in each lane:
//
//   G = sum_ij w_i w_j / |p_i - p_j|,     p_i = middle + (s_i - 1/2) line + zeta_i level,     level = h n            [1/m]
//
// over the fine points less that over the coarse points. Products that need few digits are taken in single precision.
#pragma once

#if defined(__AVX512F__)
#include <immintrin.h>
#endif

#include <algorithm>
#include <cstring>

#include "magshell/core/simd_float.h"
#include "magshell/energy/own_field_near_pairs.h"

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

/// A pair in each lane: numbers, dual numbers, or dual numbers in single precision whose rates are relative to `unit`.
template <class T, class Value>
struct PairLanes {
    using Lanes = std::conditional_t<std::is_same_v<T, Dual>, DualLanes<Value>, Value>;
    static constexpr int width = Value::width;

    static void set(Lanes& a, int lane, const T& b, double unit) {
        if constexpr (std::is_same_v<T, Dual>) {
            a.value.set(lane, b.value);
            a.rate.set(lane, b.rate / unit);
        } else {
            a.set(lane, b);
        }
    }
    static void set(Triple<Lanes>& a, int lane, const Triple<T>& b, double unit) {
        set(a.x, lane, b.x, unit);
        set(a.y, lane, b.y, unit);
        set(a.z, lane, b.z, unit);
    }
    static T get(const Lanes& a, int lane, double unit) {
        if constexpr (std::is_same_v<T, Dual>)
            return {a.value[lane], unit * a.rate[lane]};
        else
            return a[lane];
    }
    static Triple<T> get(const Triple<Lanes>& a, int lane, double unit) {
        return {get(a.x, lane, unit), get(a.y, lane, unit), get(a.z, lane, unit)};
    }
};

/// An edge, whose points are at middle + (s - 1/2) line + zeta level.
template <class T>
struct EdgePose {
    Triple<T> middle, line, level;
};

/// The sums for pairs of edges in lanes.
template <class T, class Value>
class EdgePairMeans {
  public:
    using Pair = PairLanes<T, Value>;
    using Lanes = typename Pair::Lanes;
    static constexpr int width = Value::width;

    explicit EdgePairMeans(double unit) : unit_(unit) {}

    void set(int lane, const EdgePose<T>& first, const EdgePose<T>& second) {
        Pair::set(apart_, lane, first.middle - second.middle, unit_);
        const EdgePose<T>* const places[2] = {&first, &second};
        for (int side = 0; side < 2; ++side) {
            Pair::set(lines_[side], lane, places[side]->line, unit_);
            Pair::set(levels_[side], lane, places[side]->level, unit_);
        }
    }

    /// Adds `sign` times the sum over the points of a rule.
    template <class Rule>
    void add(const Rule& rule, double sign) {
        Value places[4], weights[4];  // places: along the edge and through the thickness
        for (int i = 0; i < rule.count; ++i) {
            places[i] = Value(number(rule.points[i] - 0.5));
            weights[i] = Value(number(rule.weights[i]));
        }
        for (int i = 0; i < rule.count; ++i)
            for (int iz = 0; iz < rule.count; ++iz) {
                const Triple<Lanes> at =
                    apart_ + scaled(places[i], lines_[0]) + scaled(places[iz], levels_[0]);
                const Value weight = Value(number(sign)) * weights[i] * weights[iz];
                Triple<Lanes> total{};
                for (int j = 0; j < rule.count; ++j) {
                    const Triple<Lanes> from = at - scaled(places[j], lines_[1]);
                    const Value both = weight * weights[j];
                    Triple<Lanes> row{};
                    for (int jz = 0; jz < rule.count; ++jz) {
                        Triple<Lanes> force;
                        interact(from - scaled(places[jz], levels_[1]), both * weights[jz], value_, force);
                        row += force;
                        add_scaled(places[jz], force, by_level_[1]);
                    }
                    total += row;
                    add_scaled(places[j], row, by_line_[1]);
                }
                sum_ += total;
                add_scaled(places[i], total, by_line_[0]);
                add_scaled(places[iz], total, by_level_[0]);
            }
    }

    PairDerivatives<T> operator()(int lane) const {
        PairDerivatives<T> out;
        out.value = Pair::get(value_, lane, unit_);
        const Triple<T> half = T(0.5) * Pair::get(sum_, lane, unit_);
        for (int side = 0; side < 2; ++side) {
            const T sign(side == 0 ? -1.0 : 1.0);
            const Triple<T> by_line = Pair::get(by_line_[side], lane, unit_);
            out.nodes[side][0] = sign * (half - by_line);
            out.nodes[side][1] = sign * (half + by_line);
            out.levels[side] = sign * Pair::get(by_level_[side], lane, unit_);
        }
        return out;
    }

  private:
    using Number = std::remove_cvref_t<decltype(Value{}.lanes[0])>;
    static Number number(double a) { return static_cast<Number>(a); }
    static Triple<Lanes> scaled(const Value& factor, const Triple<Lanes>& a) {
        return {factor * a.x, factor * a.y, factor * a.z};
    }
    static void add_scaled(const Value& factor, const Triple<Lanes>& more, Triple<Lanes>& out) {
        out.x += factor * more.x;
        out.y += factor * more.y;
        out.z += factor * more.z;
    }

    // Adds w / |d| to `sum`, and sets the force w d / |d|^3.
    static void interact(const Triple<Value>& d, const Value& w, Value& sum, Triple<Value>& force) {
        const Value inverse = inverse_root(dot(d, d)), strength = w * inverse;
        sum += strength;
        force = scaled(strength * inverse * inverse, d);
    }
    // The rates: d(1/r) = - g / r with g = d . d' / r^2, and d(d/r^3) = (d' - 3 g d) / r^3.
    static void interact(const Triple<DualLanes<Value>>& d, const Value& w, DualLanes<Value>& sum,
                         Triple<DualLanes<Value>>& force) {
        const Triple<Value> at{d.x.value, d.y.value, d.z.value}, moves{d.x.rate, d.y.rate, d.z.rate};
        const Value inverse = inverse_root(dot(at, at)), squared = inverse * inverse;
        const Value growth = dot(at, moves) * squared, strength = w * inverse;
        sum.value += strength;
        sum.rate -= strength * growth;
        const Value cubed = strength * squared, back = Value(number(3.0)) * growth;
        force = {{cubed * at.x, cubed * (moves.x - back * at.x)},
                 {cubed * at.y, cubed * (moves.y - back * at.y)},
                 {cubed * at.z, cubed * (moves.z - back * at.z)}};
    }

    double unit_;
    Triple<Lanes> apart_{}, lines_[2]{}, levels_[2]{};
    Lanes value_{};
    Triple<Lanes> sum_{}, by_line_[2]{}, by_level_[2]{};
};

}  // namespace own_field
}  // namespace magshell
