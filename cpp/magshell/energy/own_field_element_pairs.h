// Sums over the points of two near elements of an OwnField (energy/own_field.h), one pair in each lane:
//
//   G = sum_ij w_i w_j / |p_i - p_j|,     p_i = middle + a_i u + b_i v                                            [1/m]
//
// The points of an element share its charge and current, so that one G with its derivatives serves the pair in both directions.
#pragma once

#include <array>

#include "magshell/energy/own_field_lanes.h"
#include "magshell/energy/own_field_point_rows.h"
#include "magshell/energy/own_field_poses.h"

namespace magshell {
namespace own_field {

/// Adds w / |d| to `sum`, and sets the force w d / |d|^3.
template <class Value>
void interact(const Triple<Value>& d, const Value& w, Value& sum, Triple<Value>& force) {
    const Value inverse = inverse_root(dot(d, d)), strength = w * inverse;
    sum += strength;
    force = (strength * inverse * inverse) * d;
}
// The rates: d(1/r) = - g / r with g = d . d' / r^2, and d(d/r^3) = (d' - 3 g d) / r^3.
template <class Value>
void interact(const Triple<DualLanes<Value>>& d, const Value& w, DualLanes<Value>& sum,
              Triple<DualLanes<Value>>& force) {
    const Triple<Value> at{d.x.value, d.y.value, d.z.value}, moves{d.x.rate, d.y.rate, d.z.rate};
    const Value inverse = inverse_root(dot(at, at)), squared = inverse * inverse;
    const Value growth = dot(at, moves) * squared, strength = w * inverse;
    sum.value += strength;
    sum.rate -= strength * growth;
    const Value cubed = strength * squared, back = Value(3.0f) * growth;
    force = {{cubed * at.x, cubed * (moves.x - back * at.x)},
             {cubed * at.y, cubed * (moves.y - back * at.y)},
             {cubed * at.z, cubed * (moves.z - back * at.z)}};
}

/// Adds weight w_j / |d_j| of a point to `sum`, with its distances d_j = at - a_j u - b_j v from the points of an element, and the
/// forces times a_j and b_j to `moments`; returns the sum of forces.
template <class Pair>
Triple<typename Pair::Lanes> pull_at(const Triple<typename Pair::Lanes>& at,
                                     const typename Pair::Value& weight,
                                     const PointRows<typename Pair::Number>& rows,
                                     const Triple<typename Pair::Lanes> (&axes)[2], typename Pair::Lanes& sum,
                                     Triple<typename Pair::Lanes> (&moments)[2]) {
    using Value = typename Pair::Value;
    using Vector = Triple<typename Pair::Lanes>;
    Vector total{}, along = moments[1];
    for (const auto& row : rows) {
        const Vector from = at - Pair::scaled(Value(row.coordinate), axes[0]);
        Vector of_row{};
        for (int k = row.first; k < row.last; ++k) {
            const Value coordinate(rows[k].coordinate);
            Vector force;
            interact(from - Pair::scaled(coordinate, axes[1]), weight * Value(rows[k].weight), sum, force);
            of_row += force;
            Pair::add_scaled(coordinate, force, along);
        }
        total += of_row;
        Pair::add_scaled(Value(row.coordinate), of_row, moments[0]);
    }
    moments[1] = along;
    return total;
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
    using Rows = PointRows<typename Pair::Number>;
    static constexpr int width = Value::width;

    explicit ElementPairs(const Units& units) : units_(units) {}

    void set(int lane, const ElementPose<T>& first, const ElementPose<T>& second) {
        Pair::set(apart_, lane, first.middle - second.middle, units_.rate);
        const ElementPose<T>* const poses[2] = {&first, &second};
        for (int side = 0; side < 2; ++side) {
            for (int k = 0; k < 2; ++k) Pair::set(axes_[side][k], lane, poses[side]->axes[k], units_.rate);
            Pair::set(charges_[side], lane, T(1.0 / units_.charge) * poses[side]->charge, units_.rate);
            Pair::set(currents_[side], lane, T(1.0 / units_.charge) * poses[side]->current, units_.rate);
        }
        parts_[lane] = parts_of_larger(first.size, second.size);
        inverse_size_.set(lane, 1.0 / std::max(first.size, second.size));
    }

    /// Adds `sign` times G over points of both elements.
    void add(const Rows& of_first, const Rows& of_second, double sign) {
        for (const auto& row : of_first) {
            const Vector from = apart_ + Pair::scaled(Value(row.coordinate), axes_[0][0]);
            Vector of_row{};
            for (int k = row.first; k < row.last; ++k) {
                const Value coordinate(of_first[k].coordinate);
                const Value weight(Pair::number(sign) * of_first[k].weight);
                const Vector pull = pull_at<Pair>(from + Pair::scaled(coordinate, axes_[0][1]), weight,
                                                  of_second, axes_[1], mean_, moments_[1]);
                of_row += pull;
                Pair::add_scaled(coordinate, pull, moments_[0][1]);
            }
            pull_ += of_row;
            Pair::add_scaled(Value(row.coordinate), of_row, moments_[0][0]);
        }
    }

    /// Sets the derivatives of the energy, after all points are added. edges: both elements are edges.
    void finish(bool edges) {
        const Lanes squared = dot(apart_, apart_), inverse = inverse_root(squared);
        Lanes weight, slope;
        lift(of_elements, inverse_size_ * (squared * inverse), weight, slope);
        const Lanes along = edges ? dot(axes_[0][0], axes_[1][0]) : Lanes{};
        const Lanes product = charges_[0] * charges_[1] - currents_[0] * currents_[1] * along;
        const Lanes scaled = weight * mean_, by_mean = weight * product;
        const Lanes by_distance = inverse_size_ * (product * mean_ * slope);
        by_middle_ = (by_distance * inverse) * apart_ - by_mean * pull_;
        by_size_ = -(inverse_size_ * (by_distance * squared * inverse));
        for (int side = 0; side < 2; ++side) {
            const Lanes signed_mean = side == 0 ? -by_mean : by_mean;
            for (int k = 0; k < 2; ++k) by_axes_[side][k] = signed_mean * moments_[side][k];
            by_charges_[side] = scaled * charges_[1 - side];
            by_currents_[side] = Lanes{};
            if (!edges) continue;
            by_currents_[side] = -(scaled * currents_[1 - side] * along);
            by_axes_[side][0] -= (scaled * currents_[0] * currents_[1]) * axes_[1 - side][0];
        }
    }

    std::array<PoseAdjoint<T>, 2> operator()(int lane) const {
        const double by_charge = strength * units_.charge, energy = by_charge * units_.charge;
        const auto get = [&](const auto& a, double factor) {
            return Pair::get(a, lane, factor, units_.rate);
        };
        std::array<PoseAdjoint<T>, 2> out;
        out[0].middle = get(by_middle_, energy);
        out[1].middle = -out[0].middle;
        for (int side = 0; side < 2; ++side) {
            for (int k = 0; k < 2; ++k) out[side].axes[k] = get(by_axes_[side][k], energy);
            out[side].charge = get(by_charges_[side], by_charge);
            out[side].current = get(by_currents_[side], by_charge);
            out[side].size = get(by_size_, energy * parts_[lane][side]);
        }
        return out;
    }

  private:
    Units units_;
    std::array<std::array<double, 2>, width> parts_{};
    Value inverse_size_{};
    Vector apart_{}, axes_[2][2]{};
    Lanes charges_[2]{}, currents_[2]{};
    Lanes mean_{};  // G
    Vector pull_{}, moments_[2][2]{};
    Vector by_middle_{}, by_axes_[2][2]{};
    Lanes by_size_{}, by_charges_[2]{}, by_currents_[2]{};
};

}  // namespace own_field
}  // namespace magshell
