// What may change while a scene is solved: everything a path parameter interpolates.
#pragma once

#include <vector>

#include "magshell/core/types.h"

namespace magshell {

/// Where an obstacle has moved from its place: about its centre, and how fast it does.
struct ObstaclePose {
    Vec3 displacement = Vec3::Zero(), rotation_vector = Vec3::Zero();
    Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero();  // of its centre [m/s]; [rad/s], world axes

    bool operator==(const ObstaclePose&) const = default;
    friend ObstaclePose operator+(const ObstaclePose& a, const ObstaclePose& b) {
        return {a.displacement + b.displacement, a.rotation_vector + b.rotation_vector,
                a.velocity + b.velocity, a.spin + b.spin};
    }
    friend ObstaclePose operator*(double s, const ObstaclePose& a) {
        return {s * a.displacement, s * a.rotation_vector, s * a.velocity, s * a.spin};
    }
};

struct Controls {
    Vec3 flux_density = Vec3::Zero();     // uniform applied flux density [T]
    double field = 0.0;                   // factor on the field sources (dipoles, sampled fields)
    double load = 0.0;                    // factor on point, edge and area loads and on edge couples
    double gravity = 0.0;                 // factor on gravity
    double motion = 0.0;                  // how far prescribed motions have gone: 0 at rest, 1 at their end
    std::vector<ObstaclePose> obstacles;  // one each, or empty where none moves

    bool operator==(const Controls&) const = default;
    friend Controls operator+(const Controls& a, const Controls& b) {
        Controls sum{a.flux_density + b.flux_density,
                     a.field + b.field,
                     a.load + b.load,
                     a.gravity + b.gravity,
                     a.motion + b.motion,
                     a.obstacles.empty() ? b.obstacles : a.obstacles};
        if (!a.obstacles.empty())
            for (std::size_t k = 0; k < b.obstacles.size(); ++k)
                sum.obstacles[k] = a.obstacles[k] + b.obstacles[k];
        return sum;
    }
    friend Controls operator*(double s, const Controls& a) {
        Controls scaled{s * a.flux_density, s * a.field,  s * a.load,
                        s * a.gravity,      s * a.motion, a.obstacles};
        for (ObstaclePose& pose : scaled.obstacles) pose = s * pose;
        return scaled;
    }
};

/// The controls at `parameter` on the straight line from `from` (0) to `to` (1).
inline Controls interpolate(const Controls& from, const Controls& to, double parameter) {
    return (1.0 - parameter) * from + parameter * to;
}

}  // namespace magshell
