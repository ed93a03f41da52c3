#include "magshell/linalg/multifrontal/pivot_block.h"

#include <algorithm>
#include <cmath>

namespace magshell {
namespace {

using slabs::lanes;
using slabs::Lanes;

constexpr Index stride = PivotBlock::stride;

// Exchanges rows and columns i < k of the block, including the columns of L computed so far.
void exchange(PivotBlock& block, Index i, Index k) {
    if (i == k) return;
    const auto at = [&](Index row, Index column) -> double& { return block.entries[column * stride + row]; };
    for (Index j = 0; j < block.size; ++j) std::swap(at(i, j), at(k, j));
    for (Index j = 0; j < block.size; ++j) std::swap(at(j, i), at(j, k));
    std::swap(block.order[i], block.order[k]);
    block.permuted = true;
}

// Returns the row of the largest |entry| of a column from `first` on, excluding `skip`.
Index largest(const double* column, Index first, Index size, Index skip) {
    Index best = first == skip ? first + 1 : first;
    for (Index i = best + 1; i < size; ++i) {
        if (i != skip && std::abs(column[i]) > std::abs(column[best])) best = i;
    }
    return best;
}

// Returns the largest |entry| of a column from `first` on.
double largest_size(const double* column, Index first, Index size) {
    double found = 0.0;
    Index i = first;
    for (; i < size && i % slabs::width != 0; ++i) found = std::max(found, std::abs(column[i]));
    Lanes sizes{};
    for (; i + slabs::width <= size; i += slabs::width) sizes.raise_to_magnitude(lanes(column + i));
    for (; i < size; ++i) found = std::max(found, std::abs(column[i]));
    for (Index lane = 0; lane < slabs::width; ++lane) found = std::max(found, sizes[lane]);
    return found;
}

// Divides a column below its pivot; w receives what it was. Returns the largest |l_ik w_ik|.
double divide_column(double* column, double inverse, double* w, Index first, Index size) {
    double growth = 0.0;
    const auto divide = [&](Index i) {
        w[i] = column[i];
        column[i] *= inverse;
        growth = std::max(growth, std::abs(w[i] * column[i]));
    };
    Index i = first;
    for (; i < size && i % slabs::width != 0; ++i) divide(i);
    Lanes products{};
    for (; i + slabs::width <= size; i += slabs::width) {
        const Lanes old = lanes(column + i), divided = old * inverse;
        lanes(w + i) = old;
        lanes(column + i) = divided;
        products.raise_to_magnitude(old * divided);
    }
    for (; i < size; ++i) divide(i);
    for (Index lane = 0; lane < slabs::width; ++lane) growth = std::max(growth, products[lane]);
    return growth;
}

enum class PivotSize { one, two };

// Chooses a pivot by Bunch and Kaufman and moves it to row k (and k + 1). alpha balances the growth of 1x1 and
// 2x2 steps.
PivotSize choose_pivot(PivotBlock& block, Index k) {
    // [-] (1 + sqrt(17)) / 8, Bunch and Kaufman; plain-words: ok
    constexpr double alpha = 0.6403882032022076;
    if (k + 1 == block.size) return PivotSize::one;
    const double* column = block.entries + k * stride;
    const double diagonal = std::abs(column[k]), beside = largest_size(column, k + 1, block.size);
    if (diagonal >= alpha * beside) return PivotSize::one;

    const Index r = largest(column, k + 1, block.size, -1);
    const double* other = block.entries + r * stride;
    const double beside_other = std::abs(other[largest(other, k, block.size, r)]);
    if (diagonal * beside_other >= alpha * beside * beside) return PivotSize::one;
    if (std::abs(other[r]) >= alpha * beside_other) {
        exchange(block, k, r);
        return PivotSize::one;
    }
    exchange(block, k + 1, r);
    return PivotSize::two;
}

// Computes column j -= w_j l for all columns right of the pivot. Both triangles are stored, so that rows and
// columns are exchanged alike.
void subtract_outer(PivotBlock& block, Index first, const double* l, const double* w) {
    const Index from = first / slabs::width * slabs::width;
    for (Index j = first; j < block.size; ++j) {
        double* column = block.entries + j * stride;
        for (Index i = from; i < block.size; i += slabs::width) lanes(column + i) -= lanes(l + i) * w[j];
    }
}

}  // namespace

inline namespace MAGSHELL_FAMILY {

void PivotBlock::factorize(Pivots pivots, PivotTally& tally) {
    permuted = false;
    for (Index k = 0; k < size; ++k) order[k] = static_cast<std::int8_t>(k);
    alignas(64) double w[2][stride] = {};

    for (Index k = 0; k < size;) {
        double* column = entries + k * stride;
        if (choose_pivot(*this, k) == PivotSize::one) {
            double pivot = column[k];
            if (std::abs(pivot) < tiny_pivot) {
                pivot = std::copysign(perturbed_pivot, pivot);
                ++tally.perturbed;
            }
            pivots.diagonal[k] = pivot;
            pivots.coupling[k] = 0.0;
            tally.negative += pivot < 0.0;
            const double inverse = 1.0 / pivot;
            const double growth = divide_column(column, inverse, w[0], k + 1, size);
            tally.growth = std::max({tally.growth, growth, std::abs(pivot)});
            subtract_outer(*this, k + 1, column, w[0]);
            column[k] = 1.0;
            k += 1;
        } else {
            // The off-diagonal entry of a 2x2 pivot exceeds both its diagonal entries, so its determinant is
            // negative: one eigenvalue of each sign.
            double* next = column + stride;
            const double a = column[k], b = column[k + 1], c = next[k + 1];
            const double determinant = a * c - b * b;
            pivots.diagonal[k] = a;
            pivots.diagonal[k + 1] = c;
            pivots.coupling[k] = b;
            pivots.coupling[k + 1] = 0.0;
            tally.negative += 1;
            tally.growth = std::max(tally.growth, std::abs(b));
            for (Index i = k + 2; i < size; ++i) {
                w[0][i] = column[i];
                w[1][i] = next[i];
                column[i] = (c * w[0][i] - b * w[1][i]) / determinant;
                next[i] = (a * w[1][i] - b * w[0][i]) / determinant;
                tally.growth =
                    std::max({tally.growth, std::abs(w[0][i] * column[i]), std::abs(w[1][i] * next[i])});
            }
            subtract_outer(*this, k + 2, column, w[0]);
            subtract_outer(*this, k + 2, next, w[1]);
            column[k] = next[k + 1] = 1.0;
            column[k + 1] = 0.0;
            k += 2;
        }
    }
    for (Index k = 1; k < size; ++k) std::fill_n(entries + k * stride, k, 0.0);
}

}  // namespace MAGSHELL_FAMILY

}  // namespace magshell
