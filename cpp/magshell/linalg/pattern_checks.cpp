#include "magshell/linalg/pattern_checks.h"

#include <cmath>
#include <limits>
#include <string>

#include "magshell/core/errors.h"

namespace magshell {
namespace {

std::string text(Index number) {
    return std::to_string(number);
}

// Returns true if a column with valid bounds is sorted, begins with its diagonal entry and ends within the
// matrix; without branches, so that the usual case is one vectorized pass.
bool is_column(const SparsePattern& pattern, Index j) {
    const Index first = pattern.column_starts[j], last = pattern.column_starts[j + 1] - 1;
    const Index* rows = pattern.rows.data();
    if (first > last || rows[first] != j || rows[last] >= pattern.size) return false;
    bool ascends = true;
    for (Index k = first; k < last; ++k) ascends &= rows[k] < rows[k + 1];
    return ascends;
}

}  // namespace

void check_pattern(const SparsePattern& pattern) {
    const auto& starts = pattern.column_starts;
    const auto& rows = pattern.rows;
    if (pattern.size < 0) throw InvalidInput("the size of a matrix cannot be " + text(pattern.size));
    if (starts.size() != static_cast<std::size_t>(pattern.size) + 1) {
        throw InvalidInput("column_starts must have size + 1 = " + text(pattern.size + 1) + " entries, got " +
                           std::to_string(starts.size()));
    }
    if (starts.front() != 0 || static_cast<std::size_t>(starts.back()) != rows.size()) {
        throw InvalidInput("column_starts must run from 0 to the number of rows, " +
                           std::to_string(rows.size()) + "; it runs from " + text(starts.front()) + " to " +
                           text(starts.back()));
    }
    for (Index j = 0; j < pattern.size; ++j) {
        if (starts[j + 1] < starts[j]) throw InvalidInput("column_starts decreases after column " + text(j));
        if (static_cast<std::size_t>(starts[j + 1]) > rows.size()) {
            throw InvalidInput("column_starts[" + text(j + 1) + "] = " + text(starts[j + 1]) +
                               " exceeds the " + std::to_string(rows.size()) + " rows given");
        }
        if (is_column(pattern, j)) continue;
        Index previous = -1;
        for (Index k = starts[j]; k < starts[j + 1]; ++k) {
            const auto where = [&] {
                return "rows[" + text(k) + "] = " + text(rows[k]) + " in column " + text(j);
            };
            if (rows[k] < 0 || rows[k] >= pattern.size) {
                throw InvalidInput(where() + " is outside the matrix, whose size is " + text(pattern.size));
            }
            if (rows[k] < j) {
                throw InvalidInput(where() + " is above the diagonal; only the lower triangle is wanted");
            }
            if (rows[k] <= previous) throw InvalidInput(where() + " is not greater than the row before it");
            previous = rows[k];
        }
        if (starts[j] == starts[j + 1] || rows[starts[j]] != j) {
            throw InvalidInput("column " + text(j) +
                               " lacks its diagonal entry; keep it, with value 0 if need be");
        }
    }
}

void check_points(const SparsePattern& pattern, const std::vector<Vec3>& points) {
    if (points.empty()) return;
    if (points.size() != static_cast<std::size_t>(pattern.size))
        throw InvalidInput("points must be one for each of the " + text(pattern.size) + " unknowns, got " +
                           std::to_string(points.size()));
    for (Index j = 0; j < pattern.size; ++j)
        if (!points[j].allFinite()) throw InvalidInput("points[" + text(j) + "] is not finite");
}

void check_finite(std::span<const double> values) {
    bool all_finite = true;  // without branches, so that the usual case is one vectorized pass
    for (std::size_t k = 0; k < values.size(); ++k)
        all_finite &= std::abs(values[k]) <= std::numeric_limits<double>::max();
    if (all_finite) return;
    for (std::size_t k = 0; k < values.size(); ++k) {
        if (std::isfinite(values[k])) continue;
        throw InvalidInput("values[" + std::to_string(k) + "] is " + std::to_string(values[k]) +
                           "; the entries of a matrix to factorize must be finite");
    }
}

void check_solvable(const FactorReport& report, Index size, const Eigen::Ref<Eigen::MatrixXd>& rhs) {
    if (!report.succeeded) throw InvalidInput("there is no factorization to solve with: " + report.reason);
    if (rhs.rows() != size) {
        throw InvalidInput("the right-hand side must have " + text(size) + " rows, got " +
                           std::to_string(rhs.rows()));
    }
}

}  // namespace magshell
