// Rotations as vectors: R(phi) turns about phi by |phi|.
#pragma once

#include "magshell/core/types.h"

namespace magshell {

Mat3 rotation(const Vec3& vector);

/// J(phi)^T v. As phi changes by dphi, R y turns by J(phi) dphi, with the left Jacobian of the rotations,
/// J(phi) = I + (1 - cos a)/a^2 [phi] + (a - sin a)/a^3 [phi]^2, a = |phi|.
Vec3 transposed_jacobian_times(const Vec3& phi, const Vec3& v);

}  // namespace magshell
