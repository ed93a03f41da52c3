// Solid bodies around a sheet, as signed distances: what contact needs of them.
#pragma once

#include "magshell/core/types.h"

namespace magshell {

/// At one point: how far it is from the surface, the way there, and how that way turns.
struct Distance {
    double value;    // [m], negative inside the body
    Vec3 normal;     // gradient of the value, of length one
    Mat3 curvature;  // second derivatives of the value [1/m]
};

/// A body in a frame of its own. Scenes place it.
class Obstacle {
  public:
    virtual ~Obstacle() = default;

    /// The signed distance at a point [m]. To be called from any thread. Where it has no derivatives
    /// (corners, the middle of a body), the limit from one side.
    virtual Distance distance(const Vec3& point) const = 0;
};

}  // namespace magshell
