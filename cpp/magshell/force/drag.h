// Drag: the force of surrounding water on a moving face: drag, thrust and viscous drag.
//
//   f = 1/2 rho A (C_d(phi) |u|^2 d - C_t(phi) |u|^2 n)                        [N]   [Chen22] (42), (43)
//     + A (b_n n n^T + b_t (I - n n^T)) u            resistive-force theory [Gray55]
//
// with the flow u relative to the face (the water's velocity minus the mean velocity of the corners), its
// direction d, the current area A and unit normal n, and the coefficients b of viscous drag [N s/m3]. A third of f
// acts on each corner. The inertia of the water is in added_mass.h.
//
// n is oriented against the flow, n . u <= 0, so that both sides of a face behave alike: the printed equations
// leave the sign open, and drag and thrust would cancel on one of the sides. With the face's own normal n, s =
// n . d in [-1, 1] and k the sign of s, drag and thrust are
//
//   f = 1/2 rho A |u|^2 (D d + T n),    sin phi = |s|,   D = C_d(phi),   T = k C_t(phi)
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
#include <vector>

#include "magshell/force/moving_face.h"

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
    double added_mass = 0.0;               // m, for motion along the normal [kg/m2]
    double normal_viscous_drag = 0.0;      // b_n, for flow across a face [N s/m3]
    double tangential_viscous_drag = 0.0;  // b_t, for flow along it [N s/m3]
    AttackCurve drag_curve, thrust_curve;
};

/// The force of water on one face. Stores references to the water and the face, which must outlive it.
class Drag {
  public:
    /// The Jacobian of the force on each corner. The velocity of a single corner counts a third.
    struct Jacobian {
        std::array<Mat3, 3> by_position;  // by the position of each corner               [N/m]
        Mat3 by_velocity;                 // by the corners' mean velocity     [N s/m]
    };

    /// The gradient of a vector's product with the force, by the properties of the water.
    struct Gradient {
        double fluid_density = 0.0, drag_coefficient = 0.0, thrust_coefficient = 0.0;
        double normal_viscous_drag = 0.0, tangential_viscous_drag = 0.0;
        Vec3 velocity = Vec3::Zero();

        void add(const Gradient& other, double factor) {
            fluid_density += factor * other.fluid_density;
            drag_coefficient += factor * other.drag_coefficient;
            thrust_coefficient += factor * other.thrust_coefficient;
            normal_viscous_drag += factor * other.normal_viscous_drag;
            tangential_viscous_drag += factor * other.tangential_viscous_drag;
            velocity += factor * other.velocity;
        }
    };

    Drag(const Water& water, const MovingFace& face) : water_(water), face_(face) {
        const Vec3& normal = face.normal;
        speed_ = face.flow.norm();
        direction_ = MovingFace::reciprocal(speed_) * face.flow;

        const double sine = normal.dot(direction_);
        const double side = sine > 0.0 ? 1.0 : sine < 0.0 ? -1.0 : 0.0;
        const Vec3 slip = normal - sine * direction_;
        const double cosine = slip.norm();
        by_flow_ = MovingFace::reciprocal(cosine) * slip;
        by_normal_ = cosine * direction_ - sine * by_flow_;

        const AttackCurve::Sample drag = water.drag_curve.at(std::abs(sine), cosine);
        const AttackCurve::Sample thrust = water.thrust_curve.at(std::abs(sine), cosine);
        drag_ = {drag.value, side * drag.slope};
        thrust_ = {side * thrust.value, thrust.slope};
    }

    /// Returns f / 3.
    Vec3 corner_force() const {
        const Vec3 pushed = drag().value * direction_ + thrust().value * face_.normal;
        return (face_.area / 3.0) * (pressure() * pushed + water_.tangential_viscous_drag * face_.flow +
                                     (excess() * across()) * face_.normal);
    }

    Jacobian corner_jacobian() const {
        // With N = 2 A n: dA = n . dN / 2, A dn = (dN - n n . dN) / 2.
        const Vec3& n = face_.normal;
        Mat3 by_across =
            pressure() * (drag().value * direction_ * n.transpose() + turning() * by_normal_.transpose()) +
            water_.tangential_viscous_drag * face_.flow * n.transpose() +
            excess() * n * (face_.flow - across() * n).transpose();
        by_across.diagonal().array() += pressure() * thrust().value + excess() * across();
        by_across /= 6.0;

        Jacobian jacobian;
        for (int k = 0; k < 3; ++k) jacobian.by_position[k] = face_.by_corner(by_across, k);
        jacobian.by_velocity = by_flow() / -3.0;
        return jacobian;
    }

    /// Returns the gradient of lambda . f. For three vectors on the corners, lambda is their mean.
    Gradient gradient(const Vec3& lambda) const {
        const double along = face_.normal.dot(lambda);
        const double by_drag = face_.area * direction_.dot(lambda), by_thrust = face_.area * along;
        return {
            .fluid_density = 0.5 * speed_ * speed_ * (by_drag * drag().value + by_thrust * thrust().value),
            .drag_coefficient = pressure() * by_drag * drag_.value,
            .thrust_coefficient = pressure() * by_thrust * thrust_.value,
            .normal_viscous_drag = by_thrust * across(),
            .tangential_viscous_drag = face_.area * (lambda.dot(face_.flow) - along * across()),
            .velocity = by_flow().transpose() * lambda};
    }

  private:
    /// Returns n . u [m/s], and b_n - b_t [N s/m3].
    double across() const { return face_.normal.dot(face_.flow); }
    double excess() const { return water_.normal_viscous_drag - water_.tangential_viscous_drag; }

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
    Vec3 turning() const { return drag().slope * direction_ + thrust().slope * face_.normal; }

    /// Returns df/du [N s/m].
    Mat3 by_flow() const {
        const Vec3& n = face_.normal;
        Mat3 m = (drag().value * direction_ + 2.0 * thrust().value * n) * direction_.transpose() +
                 turning() * by_flow_.transpose();
        m.diagonal().array() += drag().value;
        m *= 0.5 * water_.fluid_density * face_.area * speed_;
        m += (excess() * face_.area) * n * n.transpose();
        m.diagonal().array() += water_.tangential_viscous_drag * face_.area;
        return m;
    }

    const Water& water_;
    const MovingFace& face_;
    double speed_;                       // |u|
    Vec3 direction_;                     // d
    Vec3 by_flow_, by_normal_;           // e_u, e_n
    AttackCurve::Sample drag_, thrust_;  // of the curves alone, as functions of psi
};

}  // namespace magshell
