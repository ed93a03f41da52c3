// Penalty energy of a point that is too close to an obstacle.
//
//   E = k_n S(d),   N = k_n S'(d),   d = offset - distance                                       [J], [N]
//
// The force N pushes along the obstacle's normal. It is linear in the depth d, but for a short parabola that
// makes its derivative continuous:  S' = d^2/(2 e) up to d = e, d - e/2 from there on.   [Geilinger et al.
// 2020]
#pragma once

namespace magshell {

/// What a contact is made of; one for all its points.
struct ContactLaw {
    double stiffness = 0.0;       // k_n [N/m], of each point
    double smoothing = 0.0;       // e [m]
    double offset = 0.0;          // [m], the distance that points keep
    double friction = 0.0;        // coefficient of friction
    double sticking_speed = 0.0;  // [m/s], below which friction holds
};

/// S and its derivatives at a depth [m] > 0, for a stiffness of one.
struct Penalty {
    double energy, force, stiffness;
    double force_by_smoothing;  // at the same depth

    Penalty(double depth, double smoothing) {
        if (depth < smoothing) {
            stiffness = depth / smoothing;
            force = 0.5 * depth * stiffness;
            energy = depth * force / 3.0;
        } else {
            const double beyond = depth - 0.5 * smoothing;
            stiffness = 1.0;
            force = beyond;
            energy = 0.5 * beyond * beyond + smoothing * smoothing / 24.0;
        }
        force_by_smoothing = -0.5 * stiffness * stiffness;
    }
};

}  // namespace magshell
