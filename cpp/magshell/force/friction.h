// Coulomb friction of a point, made smooth where it sticks.
//
//   f = - mu N s(u/e) t,   v_t = (I - n n^T) v,   u = |v_t|,   t = v_t/u,   s(y) = 2 y - y^2 up to y = 1, 1
//   beyond
//
// v is the velocity relative to the obstacle, N the normal force, e the sticking speed: what would stick
// creeps slower than e, under a load that is a share r of mu N at e (1 - sqrt(1 - r)). s as in Li et al. 2020 (IPC).
//
// A Newton step from sliding knows nothing of sticking, as f does not change with u there, and overshoots.
// With the secant s/u in place of the slope it never does: f is then bounded from above by a quadratic potential.
#pragma once

#include <algorithm>

#include "magshell/core/types.h"

namespace magshell {

/// The force for mu = 1, and its derivatives.
struct Friction {
    Vec3 force;
    Vec3 by_normal_force;    // df/dN
    Mat3 by_velocity;        // df/dv, symmetric and never positive
    Mat3 secant;             // - mu N (s/u) (I - n n^T), with f = secant v
    Mat3 by_normal;          // df/dn
    Vec3 by_sticking_speed;  // df/de

    Friction(double normal_force, const Vec3& normal, const Vec3& velocity, double sticking_speed) {
        const double along = normal.dot(velocity);
        const Vec3 sliding = velocity - along * normal;
        const double speed = sliding.norm(), y = speed / sticking_speed;
        // h = s/u, and h'/u
        const double per_speed = y < 1.0 ? (2.0 - y) / sticking_speed : 1.0 / speed;
        double slope = 0.0;
        if (y >= 1.0)
            slope = -1.0 / (speed * speed * speed);
        else if (speed > 0.0)
            slope = -1.0 / (sticking_speed * sticking_speed * speed);
        by_normal_force = -per_speed * sliding;
        force = normal_force * by_normal_force;
        const Mat3 along_sliding = slope * sliding * sliding.transpose();
        const Mat3 turning = per_speed * Mat3::Identity() + along_sliding;
        secant = -normal_force * per_speed * (Mat3::Identity() - normal * normal.transpose());
        by_velocity = secant - normal_force * along_sliding;
        // dh/de = - 2 (1 - y)/e^2 where it sticks
        const double sticking = std::max(1.0 - y, 0.0) / (sticking_speed * sticking_speed);
        by_sticking_speed = 2.0 * normal_force * sticking * sliding;
        // dv_t/dn = -(n . v) I - n v^T
        by_normal = normal_force * turning * (along * Mat3::Identity() + normal * velocity.transpose());
    }
};

}  // namespace magshell
