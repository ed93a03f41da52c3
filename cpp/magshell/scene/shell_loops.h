// Parallel loops over the faces and dihedral angles of a shell, for functions that only read a state.
#pragma once

#include <algorithm>
#include <vector>

#include "magshell/assembly/dihedral_angles.h"
#include "magshell/core/parallel.h"

namespace magshell::shell_loops {

constexpr Index block = 1024;  // number of angles or faces; a multiple of the SIMD width

/// Calls body(first, last) on blocks that cover [0, count), on all threads.
template <class Body>
void over_blocks(Index count, const Body& body) {
    parallel_for((count + block - 1) / block,
                 [&](int k) { body(k * block, std::min((k + 1) * block, count)); });
}

/// Returns the change theta - theta~ of every dihedral angle.
inline std::vector<double> angle_changes(const Shell& shell, const double* q) {
    std::vector<double> changes(shell.dihedrals.size());
    over_blocks(static_cast<Index>(changes.size()), [&](Index from, Index to) {
        for (Index first = from; first < to; first += SimdDouble::width) {
            const Index last = std::min(first + SimdDouble::width, to);
            const SimdDouble angle = dihedral_angles_at(shell, first, last, q).angle();
            for (Index h = first; h < last; ++h)
                changes[h] = angle_change(shell.dihedrals[h], angle[h - first]);
        }
    });
    return changes;
}

}  // namespace magshell::shell_loops
