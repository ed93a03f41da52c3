// Arranges samples of the applied field in SIMD vectors, as the magnetic kernels take them.
#pragma once

#include "magshell/assembly/lanes.h"
#include "magshell/energy/magnetic_face.h"
#include "magshell/field/applied_field.h"

namespace magshell {

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

}  // namespace magshell
