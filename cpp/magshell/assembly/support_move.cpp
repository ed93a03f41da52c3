#include "magshell/assembly/support_move.h"

#include "magshell/core/rotation_vector.h"

namespace magshell {

Vec3 SupportMove::point(const Vec3& rest, double progress) const {
    return center + direction(rest - center, progress) + progress * translation;
}

Vec3 SupportMove::direction(const Vec3& rest, double progress) const {
    return rotation(progress * rotation_vector) * rest;
}

Vec3 SupportMove::point_rate(const Vec3& rest, double progress) const {
    return direction_rate(rest - center, progress) + translation;
}

Vec3 SupportMove::direction_rate(const Vec3& rest, double progress) const {
    return rotation_vector.cross(direction(rest, progress));
}

void SupportMove::point_vjp(const Vec3& rest, double progress, const Vec3& by_place, SupportMove& out) const {
    out.translation += progress * by_place;
    out.center += by_place - rotation(progress * rotation_vector).transpose() * by_place;
    direction_vjp(rest - center, progress, by_place, out);
}

void SupportMove::direction_vjp(const Vec3& rest, double progress, const Vec3& by_place,
                                SupportMove& out) const {
    const Vec3 torque = direction(rest, progress).cross(by_place);
    out.rotation_vector += progress * transposed_jacobian_times(progress * rotation_vector, torque);
}

}  // namespace magshell
