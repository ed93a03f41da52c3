#include "magshell/linalg/multifrontal/threshold_front.h"

#include <algorithm>
#include <cmath>

#include "magshell/core/parallel.h"

namespace magshell {
namespace {

// [-] Smallest pivot relative to the other entries of its column, Duff and Reid (1983). Up to 0.36 a pivot
// exists once all rows are fully summed (Bunch and Parlett 1971). Fixed by
// test_saddle_points_are_solved_and_their_inertia_is_right
constexpr double threshold = 0.1;
// [columns] eliminated before the others are brought up to date; time only. plain-words: ok
constexpr Index panel_columns = 64;

// Calls body(first, count) for blocks of columns, on several threads if there are many. The blocks depend on
// the range only.
template <class Body>
void for_columns(Index first, Index end, const Body& body) {
    const Index blocks = (end - first + panel_columns - 1) / panel_columns;
    const auto block = [&](int k) {
        const Index begin = first + panel_columns * k;
        body(begin, std::min(panel_columns, end - begin));
    };
    if (blocks == 1) return block(0);
    if (blocks > 1) parallel_for(static_cast<int>(blocks), block);
}

}  // namespace

void ThresholdFront::exchange(Index i, Index k) {
    if (i == k) return;
    columns.row(i).swap(columns.row(k));
    columns.col(i).swap(columns.col(k));
    std::swap(rows[i], rows[k]);
}

// Returns whether column `candidate`, alone or together with another one before `end` (its mate), is a pivot
// that bounds L. Row `eliminated` is the first that is left.
ThresholdFront::PivotSize ThresholdFront::test(Index candidate, Index end, Index& mate) const {
    const auto largest = [&](Index column, Index last, Index skip, Index also_skip) {
        Index best = -1;
        const double* entry = columns.data() + std::ptrdiff_t{size()} * column;
        for (Index i = eliminated; i < last; ++i) {
            if (i == skip || i == also_skip) continue;
            if (best == -1 || std::abs(entry[i]) > std::abs(entry[best])) best = i;
        }
        return best;
    };
    const auto magnitude = [&](Index row, Index column) {
        return row == -1 ? 0.0 : std::abs(columns(row, column));
    };
    const double a = columns(candidate, candidate);
    const double beside = magnitude(largest(candidate, size(), candidate, -1), candidate);
    if (std::abs(a) >= threshold * beside || std::max(std::abs(a), beside) < tiny_pivot)
        return PivotSize::one;

    mate = largest(candidate, end, candidate, -1);
    if (mate == -1) return PivotSize::none;
    const double b = columns(mate, candidate), c = columns(mate, mate);
    const double determinant = a * c - b * b;
    // The determinant must not be what rounding left of two equal products.
    if (!(std::abs(determinant) > 0.5 * std::max(std::abs(a * c), b * b))) return PivotSize::none;
    const double first = magnitude(largest(candidate, size(), candidate, mate), candidate);
    const double second = magnitude(largest(mate, size(), candidate, mate), mate);
    const double most =
        std::max(std::abs(c) * first + std::abs(b) * second, std::abs(b) * first + std::abs(a) * second);
    return threshold * most <= std::abs(determinant) ? PivotSize::two : PivotSize::none;
}

// Eliminates the 1x1 pivot at the first row that is left, from the fully summed columns before `end`.
void ThresholdFront::eliminate_one(Index end, PivotTally& tally) {
    const Index k = eliminated, left = size() - k - 1;
    double pivot = columns(k, k);
    if (std::abs(pivot) < tiny_pivot) {
        pivot = std::copysign(perturbed_pivot, pivot);
        ++tally.perturbed;
    }
    diagonal.push_back(pivot);
    coupling.push_back(0.0);
    tally.negative += pivot < 0.0;
    tally.growth = std::max(tally.growth, std::abs(pivot));
    const VectorXd w = columns.col(k).tail(left);
    columns.col(k).tail(left) /= pivot;
    const auto l = columns.col(k).tail(left);
    if (left > 0) tally.growth = std::max(tally.growth, l.cwiseProduct(w).cwiseAbs().maxCoeff());
    for (Index j = k + 1; j < end; ++j) columns.col(j).tail(left) -= w[j - k - 1] * l;
    eliminated += 1;
}

// Eliminates the 2x2 pivot at the first two rows that are left.
void ThresholdFront::eliminate_two(Index end, PivotTally& tally) {
    const Index k = eliminated, left = size() - k - 2;
    const double a = columns(k, k), b = columns(k + 1, k), c = columns(k + 1, k + 1);
    const double determinant = a * c - b * b;
    diagonal.insert(diagonal.end(), {a, c});
    coupling.insert(coupling.end(), {b, 0.0});
    tally.negative += determinant < 0.0 ? 1 : a < 0.0 ? 2 : 0;
    tally.growth = std::max({tally.growth, std::abs(a), std::abs(b), std::abs(c)});
    Eigen::MatrixX2d w = columns.block(k + 2, k, left, 2);
    auto l = columns.block(k + 2, k, left, 2);
    l.col(0) = (c * w.col(0) - b * w.col(1)) / determinant;
    l.col(1) = (a * w.col(1) - b * w.col(0)) / determinant;
    if (left > 0) tally.growth = std::max(tally.growth, l.cwiseProduct(w).cwiseAbs().maxCoeff());
    for (Index j = k + 2; j < end; ++j) {
        columns.col(j).tail(left) -= w(j - k - 2, 0) * l.col(0) + w(j - k - 2, 1) * l.col(1);
    }
    eliminated += 2;
}

// Eliminates all pivots that can be taken among the columns before `end`, and subtracts them from these
// columns only. Ends when no column that is left has a pivot.
void ThresholdFront::eliminate_among(Index end, PivotTally& tally) {
    Index candidate = eliminated, refused = 0;
    while (refused < end - eliminated) {
        if (candidate >= end) candidate = eliminated;
        Index mate = -1;
        switch (test(candidate, end, mate)) {
            case PivotSize::none:
                ++refused;
                break;
            case PivotSize::one:
                exchange(eliminated, candidate);
                eliminate_one(end, tally);
                refused = 0;
                break;
            case PivotSize::two:
                exchange(eliminated, candidate);
                exchange(eliminated + 1, mate == eliminated ? candidate : mate);
                eliminate_two(end, tally);
                refused = 0;
                break;
        }
        candidate = std::max(candidate + 1, eliminated);
    }
}

// Returns L D of some rows, for the pivots from `first_pivot` on.
Eigen::MatrixXd ThresholdFront::scaled_by_pivots(Index first_row, Index row_count, Index first_pivot) const {
    Eigen::MatrixXd scaled(row_count, eliminated - first_pivot);
    for (Index k = first_pivot; k < eliminated; ++k) {
        auto column = scaled.col(k - first_pivot);
        column = columns.col(k).segment(first_row, row_count) * diagonal[k];
        if (coupling[k] != 0.0) column += columns.col(k + 1).segment(first_row, row_count) * coupling[k];
        if (k > first_pivot && coupling[k - 1] != 0.0)
            column += columns.col(k - 1).segment(first_row, row_count) * coupling[k - 1];
    }
    return scaled;
}

// Subtracts L D L^T over the pivots from `first_pivot` on from the fully summed columns from `first_column` on.
void ThresholdFront::update_columns(Index first_pivot, Index first_column) {
    const Index depth = eliminated - first_pivot, left = size() - eliminated;
    if (depth == 0) return;
    for_columns(first_column, summed, [&](Index first, Index count) {
        columns.block(eliminated, first, left, count).noalias() -=
            columns.block(eliminated, first_pivot, left, depth) *
            scaled_by_pivots(first, count, first_pivot).transpose();
    });
}

void ThresholdFront::update_below() {
    if (eliminated == 0) return;
    for_columns(0, size() - summed, [&](Index first, Index count) {
        const Index left = size() - summed - first;
        below.block(first, first, left, count).noalias() -=
            columns.block(summed + first, 0, left, eliminated) *
            scaled_by_pivots(summed + first, count, 0).transpose();
    });
}

void ThresholdFront::finish_columns() {
    for (Index k = 0; k < eliminated; ++k) {
        columns.col(k).head(k).setZero();
        columns(k, k) = 1.0;
        if (coupling[k] != 0.0) columns(k + 1, k) = 0.0;
    }
}

// Eliminates panel after panel; columns that have no pivot in their panel are moved to the end. When only such
// columns are left, each of them is tried with every other one as its mate.
void ThresholdFront::eliminate(PivotTally& tally) {
    eliminated = 0;
    Index end_untried = summed;
    while (eliminated < summed) {
        const Index first = eliminated;
        const Index end = first == end_untried ? summed : std::min(first + panel_columns, end_untried);
        eliminate_among(end, tally);
        update_columns(first, end);
        if (end == summed) break;
        for (Index refused = end - 1; refused >= eliminated; --refused) exchange(refused, --end_untried);
    }
    finish_columns();
    update_below();
}

std::size_t ThresholdFront::bytes() const {
    return sizeof(double) * (columns.size() + below.size() + diagonal.size() + coupling.size()) +
           sizeof(Index) * rows.size();
}

}  // namespace magshell
