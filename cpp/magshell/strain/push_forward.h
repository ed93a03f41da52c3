// PushForward: a material vector m pushed forward by the deformation gradient, F m, at an integration
// point of an element with N nodes. One element per SIMD lane.
//
//   F m = sum_k (g_k . m) x_k        g_k: gradient of the shape function of node k in the reference configuration [1/m]
#pragma once

#include "magshell/core/vector3.h"

namespace magshell {

template <int N>
struct PushForward {
    SimdDouble alpha[N];  // g_k . m

    /// Returns F m. Applied to nodal velocities, it returns the rate of F m.
    SimdVec3 at(const SimdVec3 x[N]) const {
        SimdVec3 y = alpha[0] * x[0];
        for (int k = 1; k < N; ++k) y += alpha[k] * x[k];
        return y;
    }
};

}  // namespace magshell
