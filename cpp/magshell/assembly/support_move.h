// A rigid move of what a support holds.
//
//   x -> center + R(t w)(x - center) + t u,   direction -> R(t w) direction           t = the progress, a
//   control
#pragma once

#include "magshell/core/types.h"

namespace magshell {

struct SupportMove {
    Vec3 center = Vec3::Zero(), rotation_vector = Vec3::Zero(), translation = Vec3::Zero();

    Vec3 point(const Vec3& rest, double progress) const;
    Vec3 direction(const Vec3& rest, double progress) const;

    /// Their rates as the progress changes.
    Vec3 point_rate(const Vec3& rest, double progress) const;
    Vec3 direction_rate(const Vec3& rest, double progress) const;

    /// Adds the gradients by the move's own vectors of `by_place` . point(rest), and of `by_place` . direction(rest).
    void point_vjp(const Vec3& rest, double progress, const Vec3& by_place, SupportMove& out) const;
    void direction_vjp(const Vec3& rest, double progress, const Vec3& by_place, SupportMove& out) const;
};

}  // namespace magshell
