// VolumeEnergy: the energy of a volume V with the reference value V_0, by laws of one or two parameters:
//
//   pressure    E = - p V                                                      p [Pa]
//   gas         E = - p_g V_0 ln(V / V_0) + p_o (V - V_0)                      isothermal, n R T = p_g V_0; p_g [Pa]: pressure
//                                                                              at the reference volume, p_o [Pa]: outside
//   liquid      E = K/2 (V - V_t)^2 / V_0                                      V_t [m3], K [Pa] bulk modulus
//   cell        E = V_0 K/2 (V / V_0 - a)^2                                    a [-], K [Pa]                     [Qiao21] 5
//
// - dE/dV is the excess of the pressure inside over that outside. A load factor f scales pressures, and with
// them E. Laws with a target volume are filled instead: their target is V_0 + f (V_t - V_0) or 1 + f (a - 1),
// at full stiffness.
#pragma once

#include <array>
#include <cmath>
#include <limits>

namespace magshell {

enum class VolumeLaw { pressure, gas, liquid, cell };

/// The names and units of a law's parameters; nullptr if it has only one.
struct VolumeNames {
    std::array<const char*, 2> names, units;
};

inline VolumeNames names_of(VolumeLaw law) {
    switch (law) {
        case VolumeLaw::pressure:
            return {{"pressure", nullptr}, {"Pa", nullptr}};
        case VolumeLaw::gas:
            return {{"gas_pressure", "outside_pressure"}, {"Pa", "Pa"}};
        case VolumeLaw::liquid:
            return {{"volume", "bulk_modulus"}, {"m3", "Pa"}};
        case VolumeLaw::cell:
            break;
    }
    return {{"volume_ratio", "stiffness"}, {"1", "Pa"}};
}

/// has_target_volume() tells whether the first parameter is a target volume; target_at_rest() returns its value
/// for the reference volume.
inline bool has_target_volume(VolumeLaw law) {
    return law == VolumeLaw::liquid || law == VolumeLaw::cell;
}
inline double target_at_rest(VolumeLaw law, double rest) {
    return law == VolumeLaw::liquid ? rest : 1.0;
}

/// Energy, dE/dV, d2E/dV2, and the derivatives of dE/dV by the parameters. magnitude: size of the terms that
/// cancel in dE/dV.
struct VolumeEnergy {
    double energy, slope, curvature = 0.0, magnitude = 0.0;
    std::array<double, 2> slope_by{};
    double slope_by_factor = 0.0, slope_by_rest = 0.0;  // slope_by_rest: by V_0

    /// Evaluates a law under a load factor.
    VolumeEnergy(VolumeLaw law, std::array<double, 2> numbers, double rest, double volume, double factor)
        : VolumeEnergy(law, loaded(law, numbers, rest, factor), rest, volume) {
        if (has_target_volume(law)) {
            slope_by_factor = slope_by[0] * (numbers[0] - target_at_rest(law, rest));
            if (law == VolumeLaw::liquid) slope_by_rest += (1.0 - factor) * slope_by[0];
            slope_by[0] *= factor;
            return;
        }
        slope_by_factor = slope;
        energy = factor == 0.0 ? 0.0 : factor * energy;  // avoids 0 times infinity
        for (double* each : {&slope, &curvature, &magnitude, &slope_by[0], &slope_by[1], &slope_by_rest})
            *each *= factor;
    }

    VolumeEnergy(VolumeLaw law, const std::array<double, 2>& numbers, double rest, double volume) {
        const auto [a, b] = numbers;
        const double ratio = volume / rest;
        switch (law) {
            case VolumeLaw::pressure:
                energy = -a * volume;
                slope = -a;
                slope_by = {-1.0, 0.0};
                return;
            case VolumeLaw::gas:
                // Without gas nothing resists compression, not even at zero volume.
                energy = b * (volume - rest);
                if (a != 0.0)
                    energy -=
                        ratio > 0.0 ? a * rest * std::log(ratio) : -std::numeric_limits<double>::infinity();
                slope = b - a / ratio;
                curvature = a / (ratio * volume);
                magnitude = b + a / ratio;
                slope_by = {-1.0 / ratio, 1.0};
                slope_by_rest = -a / volume;
                return;
            case VolumeLaw::liquid:
                energy = 0.5 * b * (volume - a) * (volume - a) / rest;
                slope = b * (volume - a) / rest;
                curvature = b / rest;
                magnitude = b * (std::abs(volume) + std::abs(a)) / rest;
                slope_by = {-b / rest, (volume - a) / rest};
                slope_by_rest = -slope / rest;
                return;
            case VolumeLaw::cell:
                energy = 0.5 * rest * b * (ratio - a) * (ratio - a);
                slope = b * (ratio - a);
                curvature = b / rest;
                magnitude = b * (std::abs(ratio) + std::abs(a));
                slope_by = {-b, ratio - a};
                slope_by_rest = -b * ratio / rest;
                return;
        }
    }

  private:
    static std::array<double, 2> loaded(VolumeLaw law, std::array<double, 2> numbers, double rest,
                                        double factor) {
        const double at_rest = target_at_rest(law, rest);
        if (has_target_volume(law)) numbers[0] = at_rest + factor * (numbers[0] - at_rest);
        return numbers;
    }
};

}  // namespace magshell
