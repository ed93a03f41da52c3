// What may change while a scene is solved: everything a path parameter interpolates.
#pragma once

#include "magshell/core/types.h"

namespace magshell {

struct Controls {
    Vec3 flux_density = Vec3::Zero();  // uniform applied flux density [T]
    double field = 0.0;                // factor on the field sources (dipoles, sampled fields)
    double load = 0.0;                 // factor on point, edge and area loads and on edge couples
    double gravity = 0.0;              // factor on gravity
    double motion = 0.0;               // how far prescribed motions have gone: 0 at rest, 1 at their end

    friend Controls operator+(const Controls& a, const Controls& b) {
        return {a.flux_density + b.flux_density, a.field + b.field, a.load + b.load, a.gravity + b.gravity,
                a.motion + b.motion};
    }
    friend Controls operator*(double s, const Controls& a) {
        return {s * a.flux_density, s * a.field, s * a.load, s * a.gravity, s * a.motion};
    }
};

/// The controls at `parameter` on the straight line from `from` (0) to `to` (1).
inline Controls interpolate(const Controls& from, const Controls& to, double parameter) {
    return (1.0 - parameter) * from + parameter * to;
}

}  // namespace magshell
