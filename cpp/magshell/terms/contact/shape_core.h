// ShapeCore: the core of a smooth shape that a rigid body carries; the shape consists of all points within a radius of it.
//
//   x(t) = y + H t,  |t| <= 1       a point (H has no columns), a segment (one) or an ellipsoid (three, its semi-axes)
//
// A ball, a capsule and, with the radius zero, an ellipsoid are such shapes.
#pragma once

#include <vector>

#include "magshell/core/types.h"

namespace magshell {

struct ShapeCore {
    Vec3 middle = Vec3::Zero();        // y, in the shape's own frame [m]
    Mat3 half = Mat3::Zero();          // H, with columns of zeros beyond the dimensions [m]
    int dimensions = 0;                // 0, 1 or 3
    double radius = 0.0, crown = 0.0;  // r, b [m]; nearest_point.h has the crown
};

/// A ball within a shape.
struct InnerBall {
    Vec3 center;  // in the shape's own frame [m]
    double radius;
};

/// Returns balls that fill the middle of a shape, so near to each other that no obstacle slips between them.
std::vector<InnerBall> inner_balls(const ShapeCore& core);

}  // namespace magshell
