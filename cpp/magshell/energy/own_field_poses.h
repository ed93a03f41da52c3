// The places of elements and faces of an OwnField (energy/own_field.h), on which sums over near pairs depend, and derivatives by them.
#pragma once

#include "magshell/core/dual.h"

namespace magshell {
namespace own_field {

/// An element, whose points are at middle + a u + b v:
///
///   edge      u = x_b - x_a,  v = h n;              a, b in [-1/2, 1/2]
///   triangle  u = x_1 - x_0,  v = x_2 - x_0;        a, b: barycentric coordinates less 1/3
template <class T>
struct ElementPose {
    Triple<T> middle, axes[2];  // u, v
    T charge{}, current{};      // current: of an edge
    double size = 0.0;
};

/// The derivatives of the energy by an ElementPose.
template <class T>
struct PoseAdjoint {
    Triple<T> middle, axes[2];
    T charge{}, current{}, size{};

    PoseAdjoint& operator+=(const PoseAdjoint& other) {
        middle += other.middle;
        for (int k = 0; k < 2; ++k) axes[k] += other.axes[k];
        charge += other.charge, current += other.current, size += other.size;
        return *this;
    }
};

/// A face with charged sides, which are at corners +- level/2.
template <class T>
struct FacePose {
    Triple<T> corners[3], level;  // level: h n
    T current{};                  // I
    double charge = 0.0;          // of the side of the normal
    double size = 0.0;
};

/// The derivatives of the energy by a FacePose.
template <class T>
struct FacePoseAdjoint {
    Triple<T> corners[3], level;
    T current{}, charge{}, size{};

    FacePoseAdjoint& operator+=(const FacePoseAdjoint& other) {
        for (int k = 0; k < 3; ++k) corners[k] += other.corners[k];
        level += other.level;
        current += other.current, charge += other.charge, size += other.size;
        return *this;
    }
};

// Returns a number or a vector times `factor`, its rate also times rate_factor.
inline double scaled(double a, double factor, double) {
    return factor * a;
}
inline Dual scaled(const Dual& a, double factor, double rate_factor) {
    return {factor * a.value, factor * rate_factor * a.rate};
}
template <class T>
Triple<T> scaled(const Triple<T>& a, double factor, double rate_factor) {
    return {scaled(a.x, factor, rate_factor), scaled(a.y, factor, rate_factor),
            scaled(a.z, factor, rate_factor)};
}

/// Returns a pose with charge and current times a factor, and with all rates times another one.
template <class T>
ElementPose<T> scaled(const ElementPose<T>& pose, double charge_factor, double rate_factor) {
    return {scaled(pose.middle, 1.0, rate_factor),
            {scaled(pose.axes[0], 1.0, rate_factor), scaled(pose.axes[1], 1.0, rate_factor)},
            scaled(pose.charge, charge_factor, rate_factor),
            scaled(pose.current, charge_factor, rate_factor),
            pose.size};
}
template <class T>
FacePose<T> scaled(const FacePose<T>& pose, double charge_factor, double rate_factor) {
    return {{scaled(pose.corners[0], 1.0, rate_factor), scaled(pose.corners[1], 1.0, rate_factor),
             scaled(pose.corners[2], 1.0, rate_factor)},
            scaled(pose.level, 1.0, rate_factor),
            scaled(pose.current, charge_factor, rate_factor),
            charge_factor * pose.charge,
            pose.size};
}

/// Returns derivatives times `energy`, those by charge and current times by_charge, and with all rates times a factor.
template <class T>
PoseAdjoint<T> scaled(const PoseAdjoint<T>& by, double energy, double by_charge, double rate_factor) {
    return {scaled(by.middle, energy, rate_factor),
            {scaled(by.axes[0], energy, rate_factor), scaled(by.axes[1], energy, rate_factor)},
            scaled(by.charge, by_charge, rate_factor),
            scaled(by.current, by_charge, rate_factor),
            scaled(by.size, energy, rate_factor)};
}
template <class T>
FacePoseAdjoint<T> scaled(const FacePoseAdjoint<T>& by, double energy, double by_charge, double rate_factor) {
    return {{scaled(by.corners[0], energy, rate_factor), scaled(by.corners[1], energy, rate_factor),
             scaled(by.corners[2], energy, rate_factor)},
            scaled(by.level, energy, rate_factor),
            scaled(by.current, by_charge, rate_factor),
            scaled(by.charge, by_charge, rate_factor),
            scaled(by.size, energy, rate_factor)};
}

}  // namespace own_field
}  // namespace magshell
