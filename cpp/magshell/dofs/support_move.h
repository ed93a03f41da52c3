// The rigid motion of the nodes of a support:
//
//   x -> center + R(t w)(x - center) + t u,   direction -> R(t w) direction           t: support factor, a load parameter
#pragma once

#include "magshell/core/types.h"

namespace magshell {

struct SupportMove {
    Vec3 center = Vec3::Zero(), rotation_vector = Vec3::Zero(), translation = Vec3::Zero();

    /// Return the position of a point, and a direction, for a support factor.
    Vec3 point(const Vec3& rest, double factor) const;
    Vec3 direction(const Vec3& rest, double factor) const;

    /// Returns the gradient by `rest` of `by_position` . point(rest) or . direction(rest), at the same center.
    Vec3 by_rest(double factor, const Vec3& by_position) const;

    /// Return their derivatives with respect to the support factor.
    Vec3 point_rate(const Vec3& rest, double factor) const;
    Vec3 direction_rate(const Vec3& rest, double factor) const;

    /// Add the gradients of `by_position` . point(rest), and of `by_position` . direction(rest), by the vectors of the move.
    void point_vjp(const Vec3& rest, double factor, const Vec3& by_position, SupportMove& out) const;
    void direction_vjp(const Vec3& rest, double factor, const Vec3& by_position, SupportMove& out) const;
};

}  // namespace magshell
