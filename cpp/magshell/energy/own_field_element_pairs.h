// Sums over the points of two near elements of an OwnField (energy/own_field.h), one pair in each lane:
//
//   G = sum_ij w_i w_j / |d_ij|,     d_ij = p_i - p_j,     p_i = middle + a_i u + b_i v                            [1/m]
//
// The points of an element share its charge and current, so that one G with its derivatives serves the pair in both directions.
#pragma once

#include <array>

#include "magshell/energy/own_field_element_points.h"
#include "magshell/energy/own_field_lanes.h"
#include "magshell/energy/own_field_poses.h"

namespace magshell {
namespace own_field {

/// Sums over the points of an element at the distances d_j from a point: of w_j / |d_j|, and of w_j / |d_j|^3 times 1, a_j, b_j, a_j^2,
/// a_j b_j, b_j^2.
template <class Lanes>
struct PointSums {
    Lanes inverse{}, cubed[6]{};
};

/// Adds w / |d| to `sum`, and returns w / |d|^3.
template <class Value>
Value interact(const Triple<Value>& d, const Value& w, Value& sum) {
    const Value inverse = inverse_root(dot(d, d)), strength = w * inverse;
    sum += strength;
    return strength * inverse * inverse;
}
// The rates: d(1/r) = - g / r and d(1/r^3) = - 3 g / r^3 with g = d . d' / r^2.
template <class Value>
DualLanes<Value> interact(const Triple<DualLanes<Value>>& d, const Value& w, DualLanes<Value>& sum) {
    const Triple<Value> at{d.x.value, d.y.value, d.z.value}, moves{d.x.rate, d.y.rate, d.z.rate};
    const Value inverse = inverse_root(dot(at, at)), squared = inverse * inverse;
    const Value growth = dot(at, moves) * squared, strength = w * inverse, cubed = strength * squared;
    sum.value += strength;
    sum.rate -= strength * growth;
    return {cubed, Value(-3.0f) * growth * cubed};
}

/// Returns the sums over points at positions, seen from a point.
template <class Pair>
[[gnu::always_inline]] inline PointSums<typename Pair::Lanes> sums_at(
    const Triple<typename Pair::Lanes>& at, const ElementPoints<typename Pair::Number>& points,
    const Triple<typename Pair::Lanes>* positions) {
    using Value = typename Pair::Value;
    using Lanes = typename Pair::Lanes;
    PointSums<Lanes> sums;
    for (int j = 0; j < points.count(); ++j) {
        const ElementPoint<typename Pair::Number>& point = points[j];
        const Lanes cubed = interact(at - positions[j], in_all_lanes<Value>(point.weight), sums.inverse);
        sums.cubed[0] += cubed;
        sums.cubed[1] += in_all_lanes<Value>(point.a) * cubed;
        sums.cubed[2] += in_all_lanes<Value>(point.b) * cubed;
        sums.cubed[3] += in_all_lanes<Value>(point.aa) * cubed;
        sums.cubed[4] += in_all_lanes<Value>(point.ab) * cubed;
        sums.cubed[5] += in_all_lanes<Value>(point.bb) * cubed;
    }
    return sums;
}

/// Sets the positions a u + b v of the points of an element, from its middle.
template <class Pair>
void set_positions(const ElementPoints<typename Pair::Number>& points,
                   const Triple<typename Pair::Lanes> (&axes)[2], Triple<typename Pair::Lanes>* positions) {
    using Value = typename Pair::Value;
    for (int j = 0; j < points.count(); ++j)
        positions[j] = Pair::scaled(in_all_lanes<Value>(points[j].a), axes[0]) +
                       Pair::scaled(in_all_lanes<Value>(points[j].b), axes[1]);
}

/// Near pairs of elements in lanes. The energy of a pair changes by
///
///   W mu_0/(4 pi) (Q Q' - I I' L . L') (G_fine - G_coarse),      L: u of an edge
///
/// with the weight W of the distance of the middles.
template <class T, class Value>
class ElementPairs {
  public:
    using Pair = PairLanes<T, Value>;
    using Lanes = typename Pair::Lanes;
    using Vector = Triple<Lanes>;
    using Points = ElementPoints<typename Pair::Number>;
    static constexpr int width = Value::width;

    void set(int lane, const ElementPose<T>& first, const ElementPose<T>& second) {
        Pair::set(apart_, lane, first.middle - second.middle);
        const ElementPose<T>* const poses[2] = {&first, &second};
        for (int side = 0; side < 2; ++side) {
            for (int k = 0; k < 2; ++k) Pair::set(axes_[side][k], lane, poses[side]->axes[k]);
            Pair::set(charges_[side], lane, poses[side]->charge);
            Pair::set(currents_[side], lane, poses[side]->current);
        }
        parts_[lane] = parts_of_larger(first.size, second.size);
        inverse_size_.set(lane, 1.0 / std::max(first.size, second.size));
    }

    /// Adds `sign` times G over points of both elements, and the sums that its derivatives consist of:
    ///
    ///   dG/d(distance of the middles) = - sum w_i w_j d / |d|^3,    d = sum_k z_k e_k,
    ///
    /// z = (1, a_i, b_i, a_j, b_j),  e = (distance of the middles, u, v, -u', -v')
    void add(const Points& of_first, const Points& of_second, double sign) {
        Vector positions[Points::most];
        set_positions<Pair>(of_second, axes_[1], positions);
        for (int i = 0; i < of_first.count(); ++i) {
            const ElementPoint<typename Pair::Number>& point = of_first[i];
            const Value weight = in_all_lanes<Value>(Pair::number(sign) * point.weight);
            const PointSums<Lanes> sums =
                sums_at<Pair>(apart_ + Pair::scaled(in_all_lanes<Value>(point.a), axes_[0][0]) +
                                  Pair::scaled(in_all_lanes<Value>(point.b), axes_[0][1]),
                              of_second, positions);
            mean_ += weight * sums.inverse;
            const Value a = weight * in_all_lanes<Value>(point.a), b = weight * in_all_lanes<Value>(point.b);
            const auto add = [&](int row, int column, const Value& factor, const Lanes& sum) {
                products_[row][column] += factor * sum;
            };
            add(0, 0, weight, sums.cubed[0]);
            add(1, 0, a, sums.cubed[0]);
            add(2, 0, b, sums.cubed[0]);
            add(3, 0, weight, sums.cubed[1]);
            add(4, 0, weight, sums.cubed[2]);
            add(1, 1, weight * in_all_lanes<Value>(point.aa), sums.cubed[0]);
            add(2, 1, weight * in_all_lanes<Value>(point.ab), sums.cubed[0]);
            add(2, 2, weight * in_all_lanes<Value>(point.bb), sums.cubed[0]);
            add(3, 1, a, sums.cubed[1]);
            add(3, 2, b, sums.cubed[1]);
            add(4, 1, a, sums.cubed[2]);
            add(4, 2, b, sums.cubed[2]);
            add(3, 3, weight, sums.cubed[3]);
            add(4, 3, weight, sums.cubed[4]);
            add(4, 4, weight, sums.cubed[5]);
        }
    }

    /// Sets the derivatives of the energy, after all points are added. edges: both elements are edges.
    void finish(bool edges) {
        const Vector parts[5] = {apart_, axes_[0][0], axes_[0][1], -axes_[1][0], -axes_[1][1]};
        Vector pulls[5];  // sum w_i w_j z_k d / |d|^3
        for (int k = 0; k < 5; ++k)
            for (int l = 0; l < 5; ++l) pulls[k] += products_[std::max(k, l)][std::min(k, l)] * parts[l];
        const Lanes squared = dot(apart_, apart_), inverse = inverse_root(squared);
        Lanes weight, slope;
        lift(of_elements, inverse_size_ * (squared * inverse), weight, slope);
        const Lanes along = edges ? dot(axes_[0][0], axes_[1][0]) : Lanes{};
        const Lanes product = charges_[0] * charges_[1] - currents_[0] * currents_[1] * along;
        const Lanes scaled = weight * mean_, by_mean = weight * product;
        const Lanes by_distance = inverse_size_ * (product * mean_ * slope);
        by_middle_ = (by_distance * inverse) * apart_ - by_mean * pulls[0];
        by_size_ = -(inverse_size_ * (by_distance * squared * inverse));
        for (int side = 0; side < 2; ++side) {
            const Lanes signed_mean = side == 0 ? -by_mean : by_mean;
            for (int k = 0; k < 2; ++k) by_axes_[side][k] = signed_mean * pulls[1 + 2 * side + k];
            by_charges_[side] = scaled * charges_[1 - side];
            by_currents_[side] = Lanes{};
            if (!edges) continue;
            by_currents_[side] = -(scaled * currents_[1 - side] * along);
            by_axes_[side][0] -= (scaled * currents_[0] * currents_[1]) * axes_[1 - side][0];
        }
    }

    /// Returns the derivatives over mu_0/(4 pi).
    std::array<PoseAdjoint<T>, 2> operator()(int lane) const {
        std::array<PoseAdjoint<T>, 2> out;
        out[0].middle = Pair::get(by_middle_, lane);
        out[1].middle = -out[0].middle;
        for (int side = 0; side < 2; ++side) {
            for (int k = 0; k < 2; ++k) out[side].axes[k] = Pair::get(by_axes_[side][k], lane);
            out[side].charge = Pair::get(by_charges_[side], lane);
            out[side].current = Pair::get(by_currents_[side], lane);
            out[side].size = T(parts_[lane][side]) * Pair::get(by_size_, lane);
        }
        return out;
    }

  private:
    std::array<std::array<double, 2>, width> parts_{};
    Value inverse_size_{};
    Vector apart_{}, axes_[2][2]{};
    Lanes charges_[2]{}, currents_[2]{};
    Lanes mean_{};            // G
    Lanes products_[5][5]{};  // sum w_i w_j z_k z_l / |d|^3, k >= l
    Vector by_middle_{}, by_axes_[2][2]{};
    Lanes by_size_{}, by_charges_[2]{}, by_currents_[2]{};
};

}  // namespace own_field
}  // namespace magshell
