#include "magshell/dofs/support_move.h"

#include "magshell/core/rotation_vector.h"

namespace magshell {

Vec3 SupportMove::point(const Vec3& rest, double factor) const {
    return center + direction(rest - center, factor) + factor * translation;
}

Vec3 SupportMove::direction(const Vec3& rest, double factor) const {
    return rotation(factor * rotation_vector) * rest;
}

Vec3 SupportMove::by_rest(double factor, const Vec3& by_position) const {
    return rotation(factor * rotation_vector).transpose() * by_position;
}

Vec3 SupportMove::point_rate(const Vec3& rest, double factor) const {
    return direction_rate(rest - center, factor) + translation;
}

Vec3 SupportMove::direction_rate(const Vec3& rest, double factor) const {
    return rotation_vector.cross(direction(rest, factor));
}

void SupportMove::point_vjp(const Vec3& rest, double factor, const Vec3& by_position,
                            SupportMove& out) const {
    out.translation += factor * by_position;
    out.center += by_position - rotation(factor * rotation_vector).transpose() * by_position;
    direction_vjp(rest - center, factor, by_position, out);
}

void SupportMove::direction_vjp(const Vec3& rest, double factor, const Vec3& by_position,
                                SupportMove& out) const {
    const Vec3 torque = direction(rest, factor).cross(by_position);
    out.rotation_vector += factor * transposed_jacobian_times(factor * rotation_vector, torque);
}

}  // namespace magshell
