// Loops over a sheet for those that only look at a state.
#pragma once

#include <algorithm>
#include <vector>

#include "magshell/assembly/folds.h"
#include "magshell/core/parallel.h"

namespace magshell::sheet_loops {

constexpr Index block = 1024;  // of folds or faces; a multiple of every pack's width

/// body(first, last) over [0, count), in blocks on all threads.
template <class Body>
void over_blocks(Index count, const Body& body) {
    parallel_for((count + block - 1) / block,
                 [&](int k) { body(k * block, std::min((k + 1) * block, count)); });
}

/// theta - theta~ of every fold.
inline std::vector<double> fold_turns(const Sheet& sheet, const double* q) {
    std::vector<double> turns(sheet.folds.size());
    over_blocks(static_cast<Index>(turns.size()), [&](Index from, Index to) {
        for (Index first = from; first < to; first += Pack::width) {
            const Index last = std::min(first + Pack::width, to);
            const Pack angle = folds_at(sheet, first, last, q).angle();
            for (Index h = first; h < last; ++h) turns[h] = turn_from(sheet.folds[h], angle[h - first]);
        }
    });
    return turns;
}

}  // namespace magshell::sheet_loops
