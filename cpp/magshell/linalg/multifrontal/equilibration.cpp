#include "magshell/linalg/multifrontal/equilibration.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "magshell/core/parallel.h"
#include "magshell/linalg/pattern_checks.h"

namespace magshell {

namespace {

// A range of columns with about the same number of entries as the others.
struct Part {
    Index begin, end;
};

// Returns one part of the columns for each thread. What is computed from the parts, largest entries, does not depend on them.
std::vector<Part> parts_of(const SparsePattern& pattern) {
    // [entries] below which one thread is fastest; changes time only, plain-words: ok
    constexpr std::size_t small = 20000;
    const int count = static_cast<int>(
        std::min<std::size_t>(num_threads(), std::max<std::size_t>(1, pattern.rows.size() / small)));
    std::vector<Part> parts;
    Index begin = 0;
    for (int k = 1; k <= count; ++k) {
        const std::size_t wanted = pattern.rows.size() * k / count;
        const auto at = std::lower_bound(pattern.column_starts.begin() + begin, pattern.column_starts.end(),
                                         static_cast<Index>(wanted));
        const Index end = k == count ? pattern.size : static_cast<Index>(at - pattern.column_starts.begin());
        parts.push_back({begin, std::min(end, pattern.size)});
        begin = parts.back().end;
    }
    return parts;
}

// The largest entry of each row of S A S, by parts of the columns.
class LargestEntries {
  public:
    explicit LargestEntries(const SparsePattern& pattern)
        : pattern_(pattern),
          parts_(parts_of(pattern)),
          of_parts_(parts_.size(), std::vector<double>(pattern.size)) {}

    /// Returns the largest entries. With scaled = false S is taken to be 1. Sets all_finite to false if a value is not finite.
    template <bool scaled>
    const std::vector<double>& find(const LargeVector<double>& values, const std::vector<double>& scale,
                                    bool& all_finite) {
        std::vector<char> finite(parts_.size());
        parallel_for(static_cast<int>(parts_.size()), [&](int k) {
            finite[k] = find_in<scaled>(parts_[k], values.data(), scale.data(), of_parts_[k]);
        });
        for (const char each : finite) all_finite &= each != 0;
        std::vector<double>& all = of_parts_.front();
        for (std::size_t k = 1; k < of_parts_.size(); ++k)
            for (Index j = 0; j < pattern_.size; ++j) all[j] = std::max(all[j], of_parts_[k][j]);
        return all;
    }

    const std::vector<Part>& parts() const { return parts_; }

  private:
    template <bool scaled>
    bool find_in(Part part, const double* values, const double* scale, std::vector<double>& result) const {
        std::fill(result.begin(), result.end(), 0.0);
        double* const largest = result.data();
        const Index* const rows = pattern_.rows.data();
        bool all_finite = true;
        for (Index j = part.begin; j < part.end; ++j) {
            const double own_scale = scale[j];
            double in_column = largest[j];
            for (Index k = pattern_.column_starts[j]; k < pattern_.column_starts[j + 1]; ++k) {
                double size = std::abs(values[k]);
                all_finite &= size <= std::numeric_limits<double>::max();
                if constexpr (scaled) size *= own_scale * scale[rows[k]];
                in_column = std::max(in_column, size);
                largest[rows[k]] = std::max(largest[rows[k]], size);
            }
            largest[j] = std::max(largest[j], in_column);
        }
        return all_finite;
    }

    const SparsePattern& pattern_;
    const std::vector<Part> parts_;
    std::vector<std::vector<double>> of_parts_;
};

// One sweep of Ruiz (2001): divides rows and columns by the square root of their largest entry. Returns whether
// the scale has changed.
bool sweep(const std::vector<double>& largest, std::vector<double>& scale) {
    bool changed = false;
    for (std::size_t j = 0; j < scale.size(); ++j) {
        const int half = largest[j] > 0.0 ? std::ilogb(largest[j]) / 2 : 0;
        if (half == 0) continue;
        scale[j] *= std::ldexp(1.0, -half);
        changed = true;
    }
    return changed;
}

// Applies a scale to the values. Returns the largest of them.
double apply(const SparsePattern& pattern, const std::vector<Part>& parts, const std::vector<double>& scale,
             LargeVector<double>& values) {
    std::vector<double> largest(parts.size(), 0.0);
    parallel_for(static_cast<int>(parts.size()), [&](int part) {
        const double* const all = scale.data();
        double* const to = values.data();
        const Index* const rows = pattern.rows.data();
        double in_part = 0.0;
        for (Index j = parts[part].begin; j < parts[part].end; ++j) {
            const double own_scale = all[j];
            for (Index k = pattern.column_starts[j]; k < pattern.column_starts[j + 1]; ++k) {
                to[k] *= own_scale * all[rows[k]];
                in_part = std::max(in_part, std::abs(to[k]));
            }
        }
        largest[part] = in_part;
    });
    return *std::max_element(largest.begin(), largest.end());
}

}  // namespace

// Two sweeps are enough for pivoting inside fronts.
double equilibrate(const SparsePattern& pattern, LargeVector<double>& values, std::vector<double>& scale) {
    std::fill(scale.begin(), scale.end(), 1.0);
    LargestEntries largest(pattern);
    bool all_finite = true;
    const std::vector<double>& unscaled = largest.find<false>(values, scale, all_finite);
    if (!all_finite) check_finite(values);
    sweep(unscaled, scale);
    sweep(largest.find<true>(values, scale, all_finite), scale);
    return apply(pattern, largest.parts(), scale, values);
}

double equilibrate_further(const SparsePattern& pattern, LargeVector<double>& values,
                           std::vector<double>& scale) {
    // [sweeps] Each of them halves the exponents of the largest entries, so that this many are never needed
    // unless the scale has no limit. plain-words: ok
    constexpr int most_sweeps = 20;
    std::vector<double> more(pattern.size, 1.0);
    LargestEntries largest(pattern);
    bool all_finite = true;
    for (int k = 0; k < most_sweeps; ++k)
        if (!sweep(largest.find<true>(values, more, all_finite), more)) break;
    for (Index j = 0; j < pattern.size; ++j) scale[j] *= more[j];
    return apply(pattern, largest.parts(), more, values);
}

}  // namespace magshell
