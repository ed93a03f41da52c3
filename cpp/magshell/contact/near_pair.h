// A pair of parts of surfaces that are near each other, and where it is from.
#pragma once

#include "magshell/contact/pair_energy.h"

namespace magshell {

struct NearPair {
    Index contact = 0;  // which SurfacePair
    ContactPair pair;
    Index first_face = 0, second_face = 0;  // a face of each part, of the surfaces
    bool swapped = false;                   // whether the first part is of surface b

    bool operator==(const NearPair&) const = default;
};

}  // namespace magshell
