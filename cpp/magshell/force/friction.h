// Friction: Coulomb friction at a contact point, regularized at small sliding speeds.
//
//   f = - N c(u/e) t,   v_t = (I - n n^T) v,   u = |v_t|,   t = v_t/u
//   c(y) = mu_s (2 y - y^2) up to y = 1, beyond from mu_s to mu_k on a cubic that ends at y = 10
//
// v is the relative velocity, N the normal force, e the sticking speed (eps_v of IPC), mu_s and mu_k the static
// and kinetic coefficients. A sticking contact creeps slower than e: under a load of a fraction r of mu_s N at
// e (1 - sqrt(1 - r)). The parabola is that of Li et al. 2020 (IPC).
//
// A Newton step from sliding overshoots into sticking, because f does not change with u while sliding. With the
// secant c/u in place of the slope it does not: f is then bounded from above by a quadratic potential.
#pragma once

#include <algorithm>

#include "magshell/core/types.h"

namespace magshell {

/// The parameters of friction.
struct FrictionLaw {
    double kinetic = 0.0;         // mu_k
    double fixed = 0.0;           // mu_s
    double sticking_speed = 0.0;  // e [m/s]
};

/// The friction force and its derivatives.
struct Friction {
    Vec3 force;
    Vec3 by_normal_force;       // df/dN
    Mat3 by_velocity;           // df/dv, symmetric; negative semidefinite unless c falls
    Mat3 secant;                // - N (c/u) (I - n n^T), with f = secant v
    Mat3 by_normal;             // df/dn
    Vec3 by_sticking_speed;     // df/de
    Vec3 by_kinetic, by_fixed;  // df/dmu_k, df/dmu_s

    Friction(double normal_force, const Vec3& normal, const Vec3& velocity, const FrictionLaw& law) {
        const double along = normal.dot(velocity);
        const Vec3 sliding = velocity - along * normal;
        const double e = law.sticking_speed, speed = sliding.norm(), y = speed / e;
        // h = c/u, h'/u, and dh/dmu_s, dh/dmu_k, dh/de
        double per_speed, slope = 0.0, by_mu_s, by_mu_k = 0.0, by_e;
        if (y < 1.0) {
            by_mu_s = (2.0 - y) / e;
            per_speed = law.fixed * by_mu_s;
            if (speed > 0.0) slope = -law.fixed / (e * e * speed);
            by_e = -2.0 * law.fixed * (1.0 - y) / (e * e);
        } else {
            constexpr double length = 9.0;  // length of the cubic in y [-]
            const double z = std::min((y - 1.0) / length, 1.0), gone = z * z * (3.0 - 2.0 * z);
            const double fall = law.fixed - law.kinetic, c = law.kinetic + (1.0 - gone) * fall;
            const double by_speed = -fall * 6.0 * z * (1.0 - z) / (length * e);
            by_mu_s = (1.0 - gone) / speed;
            by_mu_k = gone / speed;
            per_speed = c / speed;
            slope = (by_speed * speed - c) / (speed * speed * speed);
            by_e = -by_speed / e;
        }
        by_normal_force = -per_speed * sliding;
        force = normal_force * by_normal_force;
        const Mat3 along_sliding = slope * sliding * sliding.transpose();
        const Mat3 turning = per_speed * Mat3::Identity() + along_sliding;
        secant = -normal_force * per_speed * (Mat3::Identity() - normal * normal.transpose());
        by_velocity = secant - normal_force * along_sliding;
        by_sticking_speed = -normal_force * by_e * sliding;
        by_kinetic = -normal_force * by_mu_k * sliding;
        by_fixed = -normal_force * by_mu_s * sliding;
        // dv_t/dn = -(n . v) I - n v^T
        by_normal = normal_force * turning * (along * Mat3::Identity() + normal * velocity.transpose());
    }

    /// Evaluates friction with both coefficients equal to 1.
    Friction(double normal_force, const Vec3& normal, const Vec3& velocity, double sticking_speed)
        : Friction(normal_force, normal, velocity, FrictionLaw{1.0, 1.0, sticking_speed}) {}
};

}  // namespace magshell
