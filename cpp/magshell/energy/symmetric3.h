// Symmetric: a symmetric matrix of SIMD vectors, such as the stiffness C of an element's strain measures, stored
// as its lower triangle 00 10 11 20 21 22 ...
#pragma once

#include "magshell/core/vector3.h"

namespace magshell {

constexpr int lower_index(int row, int column) {
    return row * (row + 1) / 2 + column;
}

template <int N>
struct Symmetric {
    SimdDouble at[N * (N + 1) / 2];

    const SimdDouble& operator()(int i, int j) const {
        return at[i >= j ? lower_index(i, j) : lower_index(j, i)];
    }

    void times(const SimdDouble d[N], SimdDouble product[N]) const {
        for (int i = 0; i < N; ++i) {
            product[i] = (*this)(i, 0) * d[0];
            for (int j = 1; j < N; ++j) product[i] += (*this)(i, j) * d[j];
        }
    }
};

using Symmetric3 = Symmetric<3>;

}  // namespace magshell
