// Sums over an element of an OwnField and the charged sides of a face near it (energy/own_field.h), one pair in each lane. The points of
// the sides are replaced by two layers of dipoles, whose potential is the solid angle Omega of the face, seen from points of the element:
//
//   E = W mu_0/(4 pi) Q (I A + S P),     A = sum_j w_j sum_s Omega(x + zeta_s h n - p_j)/2,     P = - sum_ij w_i w_j / |p_i - p_j|
//
// with the charge Q of the element, the current I of the face, the charge +-S of its sides, and the weight W of the distance of the middles.
// Where the element is an edge of the face, the points are only taken away.
#pragma once

#include "magshell/core/simd_angle.h"
#include "magshell/energy/own_field_element_pairs.h"

namespace magshell {
namespace own_field {

/// Returns atan2(y, x), given the reciprocal of sqrt(x^2 + y^2).
template <class Value>
Value angle_of(const Value& y, const Value& x, const Value& inverse_length) {
    return magshell::angle_of(y * inverse_length, x * inverse_length);
}
template <class Value>
DualLanes<Value> angle_of(const DualLanes<Value>& y, const DualLanes<Value>& x,
                          const DualLanes<Value>& inverse_length) {
    const Value &inverse = inverse_length.value, sine = y.value * inverse, cosine = x.value * inverse;
    return {magshell::angle_of(sine, cosine), (cosine * y.rate - sine * x.rate) * inverse};
}

/// The solid angle of a triangle, seen from the origin, positive on the side of its normal, and its derivatives by the corners r:
///
///   Omega = -2 atan2(r_0 . N, O),   O = l_0 l_1 l_2 + sum_k d_k l_k,   l_k = |r_k|,  d_k = r_i . r_j,        [Van Oosterom, Strackee 1983]
///
///   (r_0 . N)^2 + O^2 = 2 prod_k (l_i l_j + d_k),    dOmega/dr_k = (F_i + F_j) / l_k,    F_k = r_i x r_j / (l_i l_j + d_k)
///
/// with k, i, j in cyclic order and N = (r_1 - r_0) x (r_2 - r_0). F_k / l_i is the field of a current along the side from r_i to r_j that
/// falls linearly from one at r_i to zero at r_j.
template <class Pair>
struct SolidAngle {
    using Lanes = typename Pair::Lanes;
    using Value = typename Pair::Value;

    Lanes value;
    Triple<Lanes> by_corner[3];

    SolidAngle(const Triple<Lanes> (&r)[3], const Triple<Lanes>& normal) {
        Lanes inverse[3], l[3], d[3], root[3];  // root: of 1 / (l_i l_j + d_k)
        for (int k = 0; k < 3; ++k) {
            const Lanes squared = dot(r[k], r[k]);
            inverse[k] = inverse_root(squared);
            l[k] = squared * inverse[k];
        }
        Triple<Lanes> f[3];
        for (int k = 0; k < 3; ++k) {
            const int i = (k + 1) % 3, j = (k + 2) % 3;
            d[k] = dot(r[i], r[j]);
            root[k] = inverse_root(l[i] * l[j] + d[k]);
            f[k] = (root[k] * root[k]) * cross(r[i], r[j]);
        }
        for (int k = 0; k < 3; ++k) by_corner[k] = inverse[k] * (f[(k + 1) % 3] + f[(k + 2) % 3]);
        const Lanes other = l[0] * l[1] * l[2] + d[0] * l[0] + d[1] * l[1] + d[2] * l[2];
        const Lanes inverse_length = Value(Pair::number(0.70710678118654752)) * (root[0] * root[1] * root[2]);
        value = Value(Pair::number(-2.0)) * angle_of(dot(r[0], normal), other, inverse_length);
    }
};

template <class T>
struct SideAdjoint {
    PoseAdjoint<T> element;
    FacePoseAdjoint<T> face;
};

/// Elements and faces with charged sides that are near, in lanes.
template <class T, class Value>
class SidePairs {
  public:
    using Pair = PairLanes<T, Value>;
    using Lanes = typename Pair::Lanes;
    using Vector = Triple<Lanes>;
    using Points = ElementPoints<typename Pair::Number>;
    static constexpr int width = Value::width;

    void set(int lane, const ElementPose<T>& element, const FacePose<T>& face) {
        for (int k = 0; k < 3; ++k) Pair::set(corners_[k], lane, face.corners[k] - element.middle);
        for (int k = 0; k < 2; ++k) Pair::set(axes_[k], lane, element.axes[k]);
        Pair::set(level_, lane, face.level);
        Pair::set(charge_, lane, element.charge);
        Pair::set(current_, lane, face.current);
        side_charge_.set(lane, face.charge);
        parts_[lane] = parts_of_larger(element.size, face.size);
        inverse_size_.set(lane, 1.0 / std::max(element.size, face.size));
    }

    /// Adds P, over the points of the sides and these of the element.
    void add_points(const Points& points) {
        const auto number = [](double a) { return in_all_lanes<Value>(Pair::number(a)); };
        Vector positions[Points::most];
        set_positions<Pair>(points, axes_, positions);
        for (const double zeta : {0.5, -0.5})
            for (const double* const weights : face_points) {
                Vector at = Pair::scaled(number(zeta), level_);
                for (int k = 0; k < 3; ++k) Pair::add_scaled(number(weights[k]), corners_[k], at);
                const PointSums<Lanes> sums = sums_at<Pair>(at, points, positions);
                const auto pull = [&](int of_one, int of_a, int of_b) {  // sums of charges w d / |d|^3
                    return Pair::scaled(
                        number(-2.0 / 3.0 * zeta),
                        sums.cubed[of_one] * at - sums.cubed[of_a] * axes_[0] - sums.cubed[of_b] * axes_[1]);
                };
                points_.value += number(-2.0 / 3.0 * zeta) * sums.inverse;
                const Vector total = pull(0, 1, 2);
                for (int k = 0; k < 3; ++k)
                    Pair::add_scaled(number(-weights[k]), total, points_.by_corner[k]);
                Pair::add_scaled(number(-zeta), total, points_.by_level);
                points_.by_axes[0] += pull(1, 3, 4);
                points_.by_axes[1] += pull(2, 4, 5);
            }
    }

    /// Adds A, over these points of the element.
    void add_angles(const Points& points) {
        const auto number = [](double a) { return in_all_lanes<Value>(Pair::number(a)); };
        const Vector normal = cross(corners_[1] - corners_[0], corners_[2] - corners_[0]);
        Vector positions[Points::most];
        set_positions<Pair>(points, axes_, positions);
        for (int s = 0; s < coarse.count; ++s) {
            const double zeta = coarse.points[s] - 0.5;
            Vector corners[3], of_level{};
            for (int k = 0; k < 3; ++k) corners[k] = corners_[k] + Pair::scaled(number(zeta), level_);
            for (int i = 0; i < points.count(); ++i) {
                const Value weight = number(coarse.weights[s]) * in_all_lanes<Value>(points[i].weight);
                const Vector r[3] = {corners[0] - positions[i], corners[1] - positions[i],
                                     corners[2] - positions[i]};
                const SolidAngle<Pair> angle(r, normal);
                angles_.value += weight * angle.value;
                Vector sum{};
                for (int k = 0; k < 3; ++k) {
                    Pair::add_scaled(weight, angle.by_corner[k], angles_.by_corner[k]);
                    sum += angle.by_corner[k];
                }
                Pair::add_scaled(weight, sum, of_level);
                Pair::add_scaled(-weight * in_all_lanes<Value>(points[i].a), sum, angles_.by_axes[0]);
                Pair::add_scaled(-weight * in_all_lanes<Value>(points[i].b), sum, angles_.by_axes[1]);
            }
            Pair::add_scaled(number(zeta), of_level, angles_.by_level);
        }
    }

    /// Sets the derivatives of the energy, after P and A are added. meets: the elements are edges of the faces.
    void finish(bool meets) {
        const Vector apart =
            Pair::scaled(Value(Pair::number(-1.0 / 3.0)), corners_[0] + corners_[1] + corners_[2]);
        const Lanes squared = dot(apart, apart), inverse = inverse_root(squared);
        Lanes weight, slope;
        lift(of_sides, meets ? Lanes{} : inverse_size_ * (squared * inverse), weight, slope);
        const Lanes potential = side_charge_ * points_.value + current_ * angles_.value;
        const Lanes scaled = weight * charge_;
        const Lanes by_points = side_charge_ * scaled, by_angles = scaled * current_;
        const auto both = [&](const Vector& of_points, const Vector& of_angles) {
            return by_points * of_points + by_angles * of_angles;
        };
        const Lanes by_distance = inverse_size_ * (charge_ * potential * slope);
        by_middle_ = (by_distance * inverse) * apart;
        const Vector by_center = Pair::scaled(Value(Pair::number(-1.0 / 3.0)), by_middle_);
        for (int k = 0; k < 3; ++k) {
            const Vector by_corner = both(points_.by_corner[k], angles_.by_corner[k]);
            by_middle_ -= by_corner;
            by_corner_[k] = by_corner + by_center;
        }
        for (int k = 0; k < 2; ++k) by_axes_[k] = both(points_.by_axes[k], angles_.by_axes[k]);
        by_level_ = both(points_.by_level, angles_.by_level);
        by_size_ = -(inverse_size_ * (by_distance * squared * inverse));
        by_charge_ = weight * potential;
        by_current_ = scaled * angles_.value;
        by_side_charge_ = scaled * points_.value;
    }

    /// Returns the derivatives over mu_0/(4 pi).
    SideAdjoint<T> operator()(int lane) const {
        SideAdjoint<T> out;
        out.element.middle = Pair::get(by_middle_, lane);
        for (int k = 0; k < 2; ++k) out.element.axes[k] = Pair::get(by_axes_[k], lane);
        out.element.charge = Pair::get(by_charge_, lane);
        out.element.size = T(parts_[lane][0]) * Pair::get(by_size_, lane);
        for (int k = 0; k < 3; ++k) out.face.corners[k] = Pair::get(by_corner_[k], lane);
        out.face.level = Pair::get(by_level_, lane);
        out.face.current = Pair::get(by_current_, lane);
        out.face.charge = Pair::get(by_side_charge_, lane);
        out.face.size = T(parts_[lane][1]) * Pair::get(by_size_, lane);
        return out;
    }

  private:
    /// P or A and its derivatives.
    struct Sums {
        Lanes value{};
        Vector by_corner[3]{}, by_level{}, by_axes[2]{};
    };

    std::array<std::array<double, 2>, width> parts_{};
    Value inverse_size_{}, side_charge_{};
    Vector corners_[3]{}, axes_[2]{}, level_{};  // corners: from the middle of the element
    Lanes charge_{}, current_{};
    Sums points_{}, angles_{};
    Vector by_middle_{}, by_axes_[2]{}, by_corner_[3]{}, by_level_{};
    Lanes by_size_{}, by_charge_{}, by_current_{}, by_side_charge_{};
};

}  // namespace own_field
}  // namespace magshell
