// Checks of patterns, values and right-hand sides that all backends share.
#pragma once

#include <span>

#include "magshell/linalg/factor.h"

namespace magshell {

/// Throws InvalidInput unless the pattern is a sorted lower triangle with a complete diagonal.
void check_pattern(const SparsePattern& pattern);

/// Throws InvalidInput unless there are no points, or one finite point for each unknown.
void check_points(const SparsePattern& pattern, const std::vector<Vec3>& points);

/// Throws InvalidInput naming the first value that is not finite.
void check_finite(std::span<const double> values);

/// Throws InvalidInput if there is no factorization, or the right-hand side has the wrong number of rows.
void check_solvable(const FactorReport& report, Index size, const Eigen::Ref<Eigen::MatrixXd>& rhs);

}  // namespace magshell
