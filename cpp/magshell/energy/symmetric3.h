// A symmetric 3x3 matrix of packs, the stiffness C of an element's three strain measures: 00 10 11 20 21 22.
#pragma once

#include "magshell/core/vector3.h"

namespace magshell {

constexpr int lower_index(int row, int column) {
    return row * (row + 1) / 2 + column;
}

struct Symmetric3 {
    Pack at[6];

    const Pack& operator()(int i, int j) const { return at[i >= j ? lower_index(i, j) : lower_index(j, i)]; }

    void times(const Pack d[3], Pack product[3]) const {
        for (int i = 0; i < 3; ++i)
            product[i] = (*this)(i, 0) * d[0] + (*this)(i, 1) * d[1] + (*this)(i, 2) * d[2];
    }
};

}  // namespace magshell
