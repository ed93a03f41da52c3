// Arranges samples of the applied field in SIMD vectors, as the magnetic kernels take them.
#pragma once

#include <vector>

#include "magshell/assembly/lanes.h"
#include "magshell/energy/magnetic_face.h"
#include "magshell/field/applied_field.h"

namespace magshell {

/// The field at all integration points of a SIMD vector of elements.
template <int points>
struct PointFields {
    FieldAtPoint at[points];
};

/// Stores sample n plus a uniform flux density [T] in one lane. Order as in AppliedField::add_samples.
inline void set_field(FieldAtPoint& field, int lane, const FieldSamples& samples, Index n, int order,
                      const Vec3& everywhere) {
    set_lane(field.flux, lane, Vec3(samples.flux[n] + everywhere));
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) {
            if (order >= 1) field.gradient.at[3 * r + c].set(lane, samples.gradient[n](r, c));
            if (order >= 2) field.curvature.at[3 * r + c].set(lane, samples.curvature[n](r, c));
        }
}

/// Returns the fields of every SIMD vector, from samples that are ordered element by element.
template <int points, class Loop>
std::vector<PointFields<points>> in_groups(const Loop& loop, const FieldSamples& samples, int order,
                                           const Vec3& everywhere) {
    std::vector<PointFields<points>> groups(loop.groups());
    for (Index group = 0; group < loop.groups(); ++group)
        for (int p = 0; p < points; ++p)
            for (int lane = 0; lane < SimdDouble::width; ++lane)
                set_field(groups[group].at[p], lane, samples, loop.element(group, lane) * points + p, order,
                          everywhere);
    return groups;
}

}  // namespace magshell
