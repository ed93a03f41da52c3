#include "magshell/terms/contact/shape_core.h"

#include <cmath>

#include "magshell/obstacle/simple_shapes.h"

namespace magshell {
namespace {

// Balls on the plane of the two longer semi-axes, at most the shortest one apart.
std::vector<InnerBall> balls_in_ellipsoid(const ShapeCore& core) {
    constexpr double least = 0.25;  // [-] radius of a ball over the shortest semi-axis
    const Vec3 semi_axes = core.half.colwise().norm();
    int thin;
    const double shortest = semi_axes.minCoeff(&thin);
    const int one = (thin + 1) % 3, two = (thin + 2) % 3;
    const Ellipsoid surface(semi_axes);
    const int reach_one = static_cast<int>(semi_axes[one] / shortest),
              reach_two = static_cast<int>(semi_axes[two] / shortest);
    std::vector<InnerBall> balls;
    for (int i = -reach_one; i <= reach_one; ++i)
        for (int j = -reach_two; j <= reach_two; ++j) {
            Vec3 at = Vec3::Zero();
            at[one] = i * shortest;
            at[two] = j * shortest;
            const double depth = -surface.distance(at).value;
            if (depth < least * shortest) continue;
            balls.push_back({core.middle + core.half * at.cwiseQuotient(semi_axes), core.radius + depth});
        }
    return balls;
}

}  // namespace

std::vector<InnerBall> inner_balls(const ShapeCore& core) {
    if (core.dimensions == 0) return {{core.middle, core.radius}};
    if (core.dimensions == 3) return balls_in_ellipsoid(core);
    const Vec3 half = core.half.col(0);
    const int parts = static_cast<int>(std::ceil(2.0 * half.norm() / core.radius));
    std::vector<InnerBall> balls;
    for (int k = 0; k <= parts; ++k)
        balls.push_back({core.middle + (2.0 * k / parts - 1.0) * half, core.radius});
    return balls;
}

}  // namespace magshell
