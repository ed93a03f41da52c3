// More functions of packs, for kernels that need them: logarithm, exponential, root, choices lane by lane.
#pragma once

#include <cmath>

#include "magshell/core/pack.h"

namespace magshell {

inline Pack log(const Pack& a) {
    Pack result;
    for (int l = 0; l < Pack::width; ++l) result.lanes[l] = std::log(a.lanes[l]);
    return result;
}

inline Pack exp(const Pack& a) {
    Pack result;
    for (int l = 0; l < Pack::width; ++l) result.lanes[l] = std::exp(a.lanes[l]);
    return result;
}

inline Pack cbrt(const Pack& a) {
    Pack result;
    for (int l = 0; l < Pack::width; ++l) result.lanes[l] = std::cbrt(a.lanes[l]);
    return result;
}

inline Pack max(const Pack& a, const Pack& b) {
    return Pack(a.lanes > b.lanes ? a.lanes : b.lanes);
}

/// a where `number` is negative, else b.
inline Pack where_negative(const Pack& number, const Pack& a, const Pack& b) {
    return Pack(number.lanes < Pack(0.0).lanes ? a.lanes : b.lanes);
}

}  // namespace magshell
