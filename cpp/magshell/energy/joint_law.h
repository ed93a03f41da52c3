// JointLaw, JointEnergy: the energy of a joint coordinate s, an angle [rad] or a length [m]: a spring, a torque
// or force, a servo that pulls towards a target with a limited torque, and soft limits.
//
//   E = k/2 (s - s_0)^2 - tau s + g e^2 / (1 + sqrt(1 + r^2)) + k_l S(s - upper) + k_l S(lower - s),   e = s - target,  r = g e / T
//
// The torque of the servo, g e / sqrt(1 + r^2), stays below T. S: energy/contact.h.
#pragma once

#include <array>
#include <cmath>

#include "magshell/energy/contact.h"

namespace magshell {

struct JointLaw {
    double spring_stiffness = 0.0, rest_coordinate = 0.0, torque = 0.0;
    double target = 0.0, servo_stiffness = 0.0, torque_limit = 0.0;
    double lower = 0.0, upper = 0.0, limit_stiffness = 0.0, limit_smoothing = 1.0;

    static constexpr int size = 10;
    using Names = std::array<const char*, size>;
    /// The parameter names of two more coordinates of a ball joint: the angle from its rotation to the target
    /// rotation of its servo, and the angle of its axis from the reference direction. Those of the coordinate of
    /// each kind of joint are in its traits (dofs/joint.h).
    static constexpr Names of_ball_servos = {nullptr,        nullptr, nullptr, nullptr, "servo_stiffness",
                                             "torque_limit", nullptr, nullptr, nullptr, nullptr};
    static constexpr Names of_cones = {nullptr, nullptr, nullptr,      nullptr,           nullptr,
                                       nullptr, nullptr, "cone_limit", "limit_stiffness", "limit_smoothing"};
};

/// Energy, dE/ds, d2E/ds2, and the derivatives of dE/ds by the parameters of the law.
struct JointEnergy {
    double energy, force, stiffness;
    std::array<double, JointLaw::size> force_by{};

    /// Returns (stiffness - force/s)/s^2 for a law whose spring and servo have the target 0, within its limits.
    /// It stays finite at s = 0.
    static double softening(const JointLaw& law, double s) {
        if (!(law.servo_stiffness > 0.0)) return 0.0;
        const double by_limit = law.servo_stiffness / law.torque_limit, root = std::hypot(1.0, by_limit * s);
        return -law.servo_stiffness * by_limit * by_limit / (root * root * root);
    }

    JointEnergy(const JointLaw& law, double s) {
        const double off = s - law.rest_coordinate, e = s - law.target;
        energy = 0.5 * law.spring_stiffness * off * off - law.torque * s;
        force = law.spring_stiffness * off - law.torque;
        stiffness = law.spring_stiffness;
        force_by[0] = off;
        force_by[1] = -law.spring_stiffness;
        force_by[2] = -1.0;
        if (law.servo_stiffness > 0.0) {
            const double g = law.servo_stiffness, r = g * e / law.torque_limit, root = std::sqrt(1.0 + r * r),
                         cube = 1.0 / (root * root * root);
            energy += g * e * e / (1.0 + root);
            force += g * e / root;
            stiffness += g * cube;
            force_by[3] = -g * cube;
            force_by[4] = e * cube;
            force_by[5] = r * r * r * cube;
        }
        if (law.limit_stiffness > 0.0)
            for (const double side : {-1.0, 1.0}) {
                const double depth = side > 0.0 ? s - law.upper : law.lower - s;
                if (!(depth > 0.0)) continue;
                const Penalty penalty(depth, law.limit_smoothing);
                energy += law.limit_stiffness * penalty.energy;
                force += side * law.limit_stiffness * penalty.force;
                stiffness += law.limit_stiffness * penalty.stiffness;
                force_by[side > 0.0 ? 7 : 6] = -law.limit_stiffness * penalty.stiffness;
                force_by[8] += side * penalty.force;
                force_by[9] += side * law.limit_stiffness * penalty.force_by_smoothing;
            }
    }
};

}  // namespace magshell
