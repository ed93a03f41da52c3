// NearPair: a pair of parts of surfaces that are near each other, and its origin.
#pragma once

#include "magshell/contact/pair_energy.h"

namespace magshell {

struct NearPair {
    Index contact = 0;  // index of the SurfacePair
    ContactPair pair;
    Index first_face = 0, second_face = 0;  // a face of each part, numbered in its surface
    bool swapped = false;                   // true: the first part belongs to surface b

    bool operator==(const NearPair&) const = default;
};

}  // namespace magshell
