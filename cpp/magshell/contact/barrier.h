// Barrier: the energy per unit area and unit stiffness of two surfaces as a function of their gap g = d -
// d_min.
//
//   barrier   b(g) = - (r - g)^2 ln(g/r) / r          up to g = r, 0 beyond                      [m]
//   penalty   b(g) = S(r - g) / r                     energy/contact.h                           [m]
//
// r is the activation distance (d-hat) of the gap. The barrier is that of Li et al. 2020 (IPC), but in the
// distance itself instead of its square, and divided by r. Its slope then has no unit, so the stiffness it is
// multiplied with is a pressure, the one at about half the activation distance (- b'(r/2) = 1.19), independent
// of mesh and time step. It is C2 and grows without bound. The slope of the penalty is C1 and at most 1, at g =
// 0: a larger pressure pushes surfaces through each other.
#pragma once

#include <cmath>
#include <limits>

#include "magshell/energy/contact.h"

namespace magshell {

/// The parameters that all pairs of a contact share.
struct BarrierLaw {
    double stiffness = 0.0;            // [Pa]
    double activation_distance = 0.0;  // r [m], > 0
    double min_distance = 0.0;         // d_min [m]: the distance where the gap is zero
    double smoothing = 0.0;            // [m] of the penalty, > 0
    bool penalty = false;              // false: barrier
};

/// b and its derivatives at a gap [m], for unit stiffness. Infinite for a barrier without a gap.
struct Barrier {
    double energy = 0.0, slope = 0.0, curvature = 0.0;  // b [m], db/dg, d2b/dg2 [1/m]
    double energy_by_activation_distance = 0.0, slope_by_activation_distance = 0.0;  // at constant gap
    double energy_by_smoothing = 0.0, slope_by_smoothing = 0.0;

    Barrier(double gap, const BarrierLaw& law) {
        const double r = law.activation_distance, per_r = 1.0 / r, y = gap * per_r, rest = 1.0 - y;
        if (rest <= 0.0) return;
        if (law.penalty) {
            const Penalty at(r - gap, law.smoothing);
            energy = per_r * at.energy;
            slope = -per_r * at.force;
            curvature = per_r * at.stiffness;
            energy_by_activation_distance = per_r * (at.force - energy);
            slope_by_activation_distance = -per_r * (at.stiffness + slope);
            // S = e^2 s(depth/e) with s homogeneous: S_e = (2 S - depth S')/e
            const double depth = r - gap;
            energy_by_smoothing = per_r * (2.0 * at.energy - depth * at.force) / law.smoothing;
            slope_by_smoothing = -per_r * at.force_by_smoothing;
            return;
        }
        if (!(y > 0.0)) {
            constexpr double endless = std::numeric_limits<double>::infinity();
            energy = curvature = endless;
            slope = -endless;
            return;
        }
        const double log = std::log(y), ratio = rest / y;
        const double value = -rest * rest * log, first = rest * (2.0 * log - ratio);
        const double second = -2.0 * log + ratio * (4.0 + ratio);
        energy = r * value;
        slope = first;
        curvature = per_r * second;
        energy_by_activation_distance = value - y * first;
        slope_by_activation_distance = -y * per_r * second;
    }
};

}  // namespace magshell
