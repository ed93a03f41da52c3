#include "magshell/assembly/motion.h"

#include "magshell/core/rotation_vector.h"

namespace magshell {

Vec3 Motion::point(const Vec3& rest, double progress) const {
    return centre + direction(rest - centre, progress) + progress * translation;
}

Vec3 Motion::direction(const Vec3& rest, double progress) const {
    return rotation(progress * rotation_vector) * rest;
}

Vec3 Motion::point_rate(const Vec3& rest, double progress) const {
    return direction_rate(rest - centre, progress) + translation;
}

Vec3 Motion::direction_rate(const Vec3& rest, double progress) const {
    return rotation_vector.cross(direction(rest, progress));
}

void Motion::point_vjp(const Vec3& rest, double progress, const Vec3& by_place, Motion& out) const {
    out.translation += progress * by_place;
    out.centre += by_place - rotation(progress * rotation_vector).transpose() * by_place;
    direction_vjp(rest - centre, progress, by_place, out);
}

void Motion::direction_vjp(const Vec3& rest, double progress, const Vec3& by_place, Motion& out) const {
    const Vec3 torque = direction(rest, progress).cross(by_place);
    out.rotation_vector += progress * transposed_jacobian_times(progress * rotation_vector, torque);
}

}  // namespace magshell
