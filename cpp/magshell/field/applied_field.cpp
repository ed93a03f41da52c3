#include "magshell/field/applied_field.h"

namespace magshell {

void FieldSamples::reset(std::size_t points, int order) {
    flux.assign(points, Vec3::Zero());
    gradient.assign(order >= 1 ? points : 0, Mat3::Zero());
    curvature.assign(order >= 2 ? points : 0, Mat3::Zero());
}

}  // namespace magshell
