// Penalty: the penalty energy of a point that is closer to an obstacle than an offset.
//
//   E = k_n S(d),   N = k_n S'(d),   d = offset - distance                                       [J], [N]
//
// The force N acts along the obstacle's normal. It is linear in the depth d, except for a short parabola at the
// beginning that makes its derivative continuous:  S' = d^2/(2 e) up to d = e, d - e/2 beyond.   [Geilinger et
// al. 2020]
#pragma once

namespace magshell {

/// The parameters of a contact with obstacles, the same for all of its points.
struct ContactLaw {
    double stiffness = 0.0;       // k_n [N/m], of each point
    double smoothing = 0.0;       // e [m]
    double offset = 0.0;          // [m] distance at which contact begins
    double friction = 0.0;        // coefficient of friction [-]
    double sticking_speed = 0.0;  // [m/s] speed below which friction is regularized
};

/// S and its derivatives at a depth [m] > 0, for unit stiffness.
struct Penalty {
    double energy, force, stiffness;
    double force_by_smoothing;  // at constant depth

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
