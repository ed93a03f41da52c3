// The applied field as magnetic kernels take it.
#pragma once

#include "magshell/assembly/lanes.h"
#include "magshell/energy/magnetic.h"
#include "magshell/field/applied_field.h"

namespace magshell {

/// Puts sample n in a lane, with a flux density that is the same everywhere [T]. Order as in AppliedField::add_samples.
inline void set_field(Magnetic::Field& field, int lane, const FieldSamples& samples, Index n, int order,
                      const Vec3& everywhere) {
    set_lane(field.flux, lane, Vec3(samples.flux[n] + everywhere));
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) {
            if (order >= 1) field.gradient.at[3 * r + c].set(lane, samples.gradient[n](r, c));
            if (order >= 2) field.curvature.at[3 * r + c].set(lane, samples.curvature[n](r, c));
        }
}

}  // namespace magshell
