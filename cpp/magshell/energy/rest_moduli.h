// What a solid's material is for small strains, which its viscosity goes by.
#pragma once

#include "magshell/core/vector3.h"

namespace magshell {

struct RestModuli {
    Pack lambda, mu;  // [Pa]
};

/// Materials whose constants are just these.
struct LameSolid {
    static constexpr int constants = 2;

    static RestModuli rest_moduli(const Pack c[]) { return {c[0], c[1]}; }
    static void rest_moduli_vjp(const Pack[], const RestModuli& by, Pack out[]) {
        out[0] += by.lambda;
        out[1] += by.mu;
    }
};

}  // namespace magshell
