// A vector of the rest shape that an element of N nodes carries along, at a point of integration. One element a lane.
//
//   F m = sum_k (g_k . m) x_k
#pragma once

#include "magshell/core/vector3.h"

namespace magshell {

template <int N>
struct PushedForwardVector {
    Pack alpha[N];  // g_k . m

    /// F m; of rates, its rate.
    Pack3 at(const Pack3 x[N]) const {
        Pack3 y = alpha[0] * x[0];
        for (int k = 1; k < N; ++k) y += alpha[k] * x[k];
        return y;
    }
};

}  // namespace magshell
