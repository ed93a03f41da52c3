// Obstacle: the interface of rigid obstacles as signed-distance functions, as contact needs them.
#pragma once

#include "magshell/core/types.h"

namespace magshell {

/// The signed distance at a point, with its first and second derivatives.
struct Distance {
    double value;    // [m], negative inside the body
    Vec3 normal;     // gradient of the value, a unit vector
    Mat3 curvature;  // second derivatives of the value [1/m]
};

/// A body in a frame of its own. Its pose is given by the scene.
class Obstacle {
  public:
    virtual ~Obstacle() = default;

    /// Returns the signed distance at a point [m]. May be called from any thread. Where it has no derivatives
    /// (corners, the middle of a body), they are the limit from one side.
    virtual Distance distance(const Vec3& point) const = 0;
};

}  // namespace magshell
