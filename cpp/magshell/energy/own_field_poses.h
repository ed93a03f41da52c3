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

}  // namespace own_field
}  // namespace magshell
