// Added mass: the inertia of the water that a face pushes along its normal n.
//
//   T = 1/2 m A s^2,   s = n . c,   c = v - U                          [J]       [Lamb32] art. 121-124
//
// v is the mean velocity of the corners, U that of the water, m the added mass [kg/m2] and A the current area. Its
// force on the corners is - d/dt dT/dv + dT/dx: each corner carries a third of the momentum m A s n, and the energy
// depends on the place of the corners through N = 2 A n,
//
//   p = m N s / 6,   dT/dx_k = g x a_k,   g = dT/dN = m (2 s c - s^2 n) / 4
//   dp/dN = m (s I + n (c - s n)^T) / 6,   dp/dc = m A n n^T / 3,   dg/dc = 3 (dp/dN)^T
//   dg/dN = m (2 (c - s n)(c - s n)^T - s^2 (I - n n^T)) / (8 A)
//
// The forces dT/dx_k have no sum and the momenta no other source, so body and water keep their common momentum; the energy
// v . dT/dv - T is kept as well while U is constant.
#pragma once

#include "magshell/force/moving_face.h"

namespace magshell {

class AddedMass {
  public:
    using Mat9 = Eigen::Matrix<double, 9, 9>;

    /// added_mass: m [kg/m2]. Stores a reference to the face, which must outlive it.
    AddedMass(double added_mass, const MovingFace& face)
        : face_(face), mass_(added_mass), speed_(-face.normal.dot(face.flow)) {
        motion_ = -face.flow;
        sideways_ = motion_ - speed_ * face.normal;
    }

    /// Returns p, the momentum that each corner carries [N s].
    Vec3 corner_momentum() const { return (mass_ * face_.area * speed_ / 3.0) * face_.normal; }
    /// Returns v . dT/dv - T [J], the kinetic energy T of the water where U is zero. water_velocity: U.
    double energy(const Vec3& water_velocity) const {
        return mass_ * face_.area * speed_ * (0.5 * speed_ + face_.normal.dot(water_velocity));
    }
    /// Returns dT/dx_k of each corner [N].
    MovingFace::Corners by_position() const {
        const Vec3 g = by_across();
        return {g.cross(face_.opposite[0]), g.cross(face_.opposite[1]), g.cross(face_.opposite[2])};
    }

    /// Returns dp/dN [N s/m2].
    Mat3 momentum_by_across() const {
        Mat3 by = face_.normal * sideways_.transpose();
        by.diagonal().array() += speed_;
        return (mass_ / 6.0) * by;
    }
    /// Returns dp/dx_k [N s/m].
    Mat3 momentum_by_position(int k) const { return face_.by_corner(momentum_by_across(), k); }
    /// Returns dp/dv [kg], by the mean velocity of the corners.
    Mat3 momentum_by_velocity() const {
        return (mass_ * face_.area / 3.0) * face_.normal * face_.normal.transpose();
    }
    /// Returns d2T/dx_k dx_l at constant velocities [N/m], rows and columns corner by corner.
    Mat9 hessian() const {
        const Vec3 g = by_across();
        Mat3 by = 2.0 * sideways_ * sideways_.transpose() +
                  (speed_ * speed_) * face_.normal * face_.normal.transpose();
        by.diagonal().array() -= speed_ * speed_;
        by *= mass_ * MovingFace::reciprocal(8.0 * face_.area);
        Mat9 all;
        for (int l = 0; l < 3; ++l) {
            const Mat3 by_corner = face_.by_corner(by, l);
            for (int k = 0; k < 3; ++k)  // g x a_k = - a_k x g
                all.block<3, 3>(3 * k, 3 * l) = -crossed(face_.opposite[k], by_corner);
            all.block<3, 3>(3 * ((l + 1) % 3), 3 * l) += crossed(g, Mat3::Identity());
            all.block<3, 3>(3 * ((l + 2) % 3), 3 * l) -= crossed(g, Mat3::Identity());
        }
        return all;
    }

    /// The gradient of a product by the mean velocity of the corners; that by the water's velocity is its opposite.
    struct Gradient {
        Vec3 velocity;
        double added_mass;
    };
    /// Returns the gradient of the product of `lambda`, the sum of vectors on the corners, with p.
    Gradient of_momentum(const Vec3& lambda) const {
        const double along = face_.area * face_.normal.dot(lambda) / 3.0;
        return {(mass_ * along) * face_.normal, along * speed_};
    }
    /// Returns the gradient of the sum of products of vectors on the corners with dT/dx_k.
    Gradient of_force(const MovingFace::Corners& lambda) const {
        Vec3 turning = Vec3::Zero();  // sum_k a_k x lambda_k, whose product with g this sum is
        for (int k = 0; k < 3; ++k) turning += face_.opposite[k].cross(lambda[k]);
        const Vec3 per_mass = (0.25 * speed_) * (2.0 * motion_ - speed_ * face_.normal);
        return {3.0 * momentum_by_across() * turning, per_mass.dot(turning)};
    }

  private:
    /// Returns g [N/m].
    Vec3 by_across() const { return (0.25 * mass_ * speed_) * (2.0 * motion_ - speed_ * face_.normal); }
    /// Returns [a]x M.
    static Mat3 crossed(const Vec3& a, const Mat3& m) {
        return -MovingFace::times_cross(m.transpose(), a).transpose();
    }

    const MovingFace& face_;
    const double mass_;       // m [kg/m2]
    const double speed_;      // s [m/s]
    Vec3 motion_, sideways_;  // c and c - s n [m/s]
};

}  // namespace magshell
