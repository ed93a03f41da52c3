// A parallel loop over sample points, in blocks large enough to be worth a thread.
#pragma once

#include <algorithm>
#include <cstddef>

#include "magshell/core/parallel.h"

namespace magshell {

/// Calls body(k) for every point k in [0, count). Each call may write to the samples of its own point only.
template <class Body>
void for_each_point(std::size_t count, const Body& body) {
    constexpr std::size_t block = 256;
    parallel_for(static_cast<int>((count + block - 1) / block), [&](int b) {
        const std::size_t first = static_cast<std::size_t>(b) * block;
        const std::size_t last = std::min(first + block, count);
        for (std::size_t k = first; k < last; ++k) body(k);
    });
}

}  // namespace magshell
