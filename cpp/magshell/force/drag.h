// Drag: the force of surrounding water on a moving face: drag, thrust and added mass.
//
//   f = 1/2 rho A (C_d(phi) |u|^2 d - C_t(phi) |u|^2 n) - m A (n . w) n        [N]   [Chen22] (42), (43)
//
// with the flow u relative to the face (the water's velocity minus the mean velocity of the corners), its
// direction d, the current area A and unit normal n, the mean acceleration w of the corners, and the added mass
// m [kg/m2]. A third of f acts on each corner.
//
// n is oriented against the flow, n . u <= 0, so that both sides of a face behave alike: the printed equations
// leave the sign open, and drag and thrust would cancel on one of the sides. With the face's own normal n, s =
// n . d in [-1, 1] and k the sign of s, this is
//
//   f = 1/2 rho A |u|^2 (D d + T n) - m A (n . w) n,    sin phi = |s|,   D = C_d(phi),   T = k C_t(phi)
//
// Derivatives use the signed angle psi = k phi, of which D is an even function and T an odd one. With c = cos
// phi and unit vectors e_u, e_n along the part of n perpendicular to d and of d perpendicular to n,
//
//   dpsi = e_u . du / |u| + e_n . dn,     e_u = (n - s d) / c,     e_n = (d - s n) / c = c d - s e_u
//
// No angle is computed by acos, whose slope is infinite at phi = pi/2. There (c = 0) e_u and e_n are set to
// zero; so are d where the water is at rest and n where the face has no area. The terms that contain them are
// then zero, or not differentiable, and zero is the mean over all directions.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "magshell/core/types.h"

namespace magshell {

// AttackCurve: a drag or thrust coefficient as a function of the angle of attack phi between a face and the
// flow: 0 where the flow is parallel to the face, pi/2 where it is perpendicular.
//
//   C(phi) = 2 sin^2 phi                                                                      [Chen22] (44)
//
// or a piecewise cubic through a table. Callers give sine and cosine of the angle; the angle is their atan2,
// which is as accurate near pi/2 as elsewhere.
class AttackCurve {
  public:
    struct Sample {
        double value;
        double slope;  // dC/dphi [1/rad]
    };
    using Cubic = std::array<double, 4>;  // coefficients of powers of (phi - knot), the highest first

    /// Creates the curve 2 sin^2 phi.
    AttackCurve() = default;

    /// Creates a piecewise cubic, one polynomial from each knot [rad] to the next; the first and the last are
    /// continued beyond the table. Throws InvalidInput unless the knots ascend and there is one polynomial less
    /// than knots.
    AttackCurve(std::vector<double> knots, std::vector<Cubic> cubics);

    /// Returns the coefficient at an angle of attack in [0, pi/2]; both arguments are nonnegative.
    Sample at(double sine, double cosine) const {
        if (cubics_.empty()) return {2.0 * sine * sine, 4.0 * sine * cosine};
        return interpolated(sine, cosine);
    }

  private:
    Sample interpolated(double sine, double cosine) const;

    std::vector<double> knots_;
    std::vector<Cubic> cubics_;  // empty: 2 sin^2 phi
};

/// The properties of the surrounding water.
struct Water {
    double fluid_density = 1000.0;  // rho [kg/m3]
    Vec3 velocity = Vec3::Zero();   // [m/s]
    double drag_coefficient = 1.0;  // C_d = drag_coefficient * drag_curve(phi), C_t likewise
    double thrust_coefficient = 1.0;
    double added_mass = 0.0;  // m, for motion along the normal [kg/m2]
    AttackCurve drag_curve, thrust_curve;
};

/// The force of water on one face. Stores a reference to the water, which must outlive it.
class Drag {
  public:
    using Corners = std::array<Vec3, 3>;

    /// The Jacobian of the force on each corner. The velocity or acceleration of a single corner counts a
    /// third.
    struct Jacobian {
        std::array<Mat3, 3> by_position;  // by the position of each corner               [N/m]
        Mat3 by_velocity;                 // by the corners' mean velocity     [N s/m]
        Mat3 by_acceleration;             // by the corners' mean acceleration [N s2/m]
    };

    /// The gradient of a vector's product with the force, by the properties of the water.
    struct Gradient {
        double fluid_density = 0.0, drag_coefficient = 0.0, thrust_coefficient = 0.0, added_mass = 0.0;
        Vec3 velocity = Vec3::Zero();

        void add(const Gradient& other, double factor) {
            fluid_density += factor * other.fluid_density;
            drag_coefficient += factor * other.drag_coefficient;
            thrust_coefficient += factor * other.thrust_coefficient;
            added_mass += factor * other.added_mass;
            velocity += factor * other.velocity;
        }
    };

    Drag(const Water& water, const Corners& positions, const Corners& velocities,
         const Corners& accelerations)
        : water_(water), acceleration_(mean(accelerations)) {
        for (int k = 0; k < 3; ++k) opposite_[k] = positions[(k + 2) % 3] - positions[(k + 1) % 3];
        const Vec3 across = opposite_[0].cross(opposite_[1]);
        area_ = 0.5 * across.norm();
        normal_ = reciprocal(2.0 * area_) * across;

        const Vec3 flow = water.velocity - mean(velocities);
        speed_ = flow.norm();
        direction_ = reciprocal(speed_) * flow;

        const double sine = normal_.dot(direction_);
        const double side = sine > 0.0 ? 1.0 : sine < 0.0 ? -1.0 : 0.0;
        const Vec3 slip = normal_ - sine * direction_;
        const double cosine = slip.norm();
        by_flow_ = reciprocal(cosine) * slip;
        by_normal_ = cosine * direction_ - sine * by_flow_;

        const AttackCurve::Sample drag = water.drag_curve.at(std::abs(sine), cosine);
        const AttackCurve::Sample thrust = water.thrust_curve.at(std::abs(sine), cosine);
        drag_ = {drag.value, side * drag.slope};
        thrust_ = {side * thrust.value, thrust.slope};
    }

    /// Returns f / 3.
    Vec3 corner_force() const {
        const Vec3 carried = normal_.dot(acceleration_) * normal_;
        const Vec3 pushed = drag().value * direction_ + thrust().value * normal_;
        return (area_ / 3.0) * (pressure() * pushed - water_.added_mass * carried);
    }

    Jacobian corner_jacobian() const {
        // With N = 2 A n: dA = n . dN / 2, A dn = (dN - n n . dN) / 2.
        const double along = normal_.dot(acceleration_);
        const Vec3 sideways = acceleration_ - along * normal_;
        Mat3 by_across = pressure() * (drag().value * direction_ * normal_.transpose() +
                                       turning() * by_normal_.transpose()) -
                         water_.added_mass * normal_ * sideways.transpose();
        by_across.diagonal().array() += pressure() * thrust().value - water_.added_mass * along;
        by_across /= 6.0;

        Jacobian jacobian;
        for (int k = 0; k < 3; ++k) {  // dN = a_k x dx_k
            const Vec3& a = opposite_[k];
            Mat3& by_corner = jacobian.by_position[k];
            by_corner.col(0) = by_across.col(1) * a.z() - by_across.col(2) * a.y();
            by_corner.col(1) = by_across.col(2) * a.x() - by_across.col(0) * a.z();
            by_corner.col(2) = by_across.col(0) * a.y() - by_across.col(1) * a.x();
        }
        jacobian.by_velocity = by_flow() / -3.0;
        jacobian.by_acceleration = (water_.added_mass * area_ / -3.0) * normal_ * normal_.transpose();
        return jacobian;
    }

    /// Returns the gradient of lambda . f. For three vectors on the corners, lambda is their mean.
    Gradient gradient(const Vec3& lambda) const {
        const double along = normal_.dot(lambda);
        const double by_drag = area_ * direction_.dot(lambda), by_thrust = area_ * along;
        return {
            .fluid_density = 0.5 * speed_ * speed_ * (by_drag * drag().value + by_thrust * thrust().value),
            .drag_coefficient = pressure() * by_drag * drag_.value,
            .thrust_coefficient = pressure() * by_thrust * thrust_.value,
            .added_mass = -area_ * normal_.dot(acceleration_) * along,
            .velocity = by_flow().transpose() * lambda};
    }

  private:
    /// Returns the mean; it is exact where all three are equal, so that no force acts on a face that moves with
    /// the water.
    static Vec3 mean(const Corners& c) { return c[0] + ((c[1] - c[0]) + (c[2] - c[0])) / 3.0; }

    /// Returns 1 / x, or 0 where x is zero.
    static double reciprocal(double x) { return x > std::numeric_limits<double>::min() ? 1.0 / x : 0.0; }

    /// Returns rho |u|^2 / 2 [Pa].
    double pressure() const { return 0.5 * water_.fluid_density * speed_ * speed_; }

    /// Return D and T with their slopes by psi.
    AttackCurve::Sample drag() const {
        return {water_.drag_coefficient * drag_.value, water_.drag_coefficient * drag_.slope};
    }
    AttackCurve::Sample thrust() const {
        return {water_.thrust_coefficient * thrust_.value, water_.thrust_coefficient * thrust_.slope};
    }

    /// Returns d(D d + T n) / dpsi at constant d and n.
    Vec3 turning() const { return drag().slope * direction_ + thrust().slope * normal_; }

    /// Returns df/du [N s/m].
    Mat3 by_flow() const {
        Mat3 m = (drag().value * direction_ + 2.0 * thrust().value * normal_) * direction_.transpose() +
                 turning() * by_flow_.transpose();
        m.diagonal().array() += drag().value;
        return (0.5 * water_.fluid_density * area_ * speed_) * m;
    }

    const Water& water_;
    Vec3 acceleration_;                  // w
    Corners opposite_;                   // a_k, the edge opposite corner k
    double area_, speed_;                // A, |u|
    Vec3 normal_, direction_;            // the face's own n, d
    Vec3 by_flow_, by_normal_;           // e_u, e_n
    AttackCurve::Sample drag_, thrust_;  // of the curves alone, as functions of psi
};

}  // namespace magshell
