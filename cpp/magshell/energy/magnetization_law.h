// MagnetizationLaw: how the magnetization of a body follows its deformation.
#pragma once

namespace magshell {

enum class MagnetizationLaw {
    stretches,  // M = F M~_r: it stretches with the body
    rotates,    // M = R M~_r: it turns with the body and keeps its magnitude
};

}  // namespace magshell
