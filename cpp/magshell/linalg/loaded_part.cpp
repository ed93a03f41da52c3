#include "magshell/linalg/loaded_part.h"

#include <algorithm>
#include <numeric>

#include "magshell/linalg/pattern_checks.h"

namespace magshell {
namespace {

// Sets of coupled unknowns, each known by its first.
class Coupled {
  public:
    explicit Coupled(Index size) : above_(size) { std::iota(above_.begin(), above_.end(), 0); }

    Index first(Index unknown) {
        while (above_[unknown] != unknown) {
            above_[unknown] = above_[above_[unknown]];
            unknown = above_[unknown];
        }
        return unknown;
    }

    bool is_known(Index first_of_one, Index other) const { return above_[other] == first_of_one; }

    /// Returns the first of both.
    Index join(Index first_of_one, Index other) {
        const Index first_of_other = first(other);
        const auto [before, after] = std::minmax(first_of_one, first_of_other);
        above_[after] = before;
        return before;
    }

  private:
    std::vector<Index> above_;
};

std::vector<char> loaded(const SparsePattern& pattern, std::span<const double> values,
                         const VectorXd& forces) {
    Coupled coupled(pattern.size);
    for (Index j = 0; j < pattern.size; ++j) {
        Index first = coupled.first(j);
        for (Index k = pattern.column_starts[j] + 1; k < pattern.column_starts[j + 1]; ++k)
            // Both at once: either by itself is as good as random, and most of what is coupled is known to be.
            if ((values[k] != 0.0) & !coupled.is_known(first, pattern.rows[k]))
                first = coupled.join(first, pattern.rows[k]);
    }
    std::vector<char> is_loaded(pattern.size, false);
    for (Index j = 0; j < pattern.size; ++j)
        if (forces[j] != 0.0) is_loaded[coupled.first(j)] = true;
    for (Index j = 0; j < pattern.size; ++j) is_loaded[j] = is_loaded[coupled.first(j)];
    return is_loaded;
}

}  // namespace

std::optional<LoadedPart> loaded_part(const SparsePattern& pattern, std::span<const double> values,
                                      const VectorXd& forces) {
    check_finite(values);
    const std::vector<char> is_loaded = loaded(pattern, values, forces);
    const Index count = static_cast<Index>(std::count(is_loaded.begin(), is_loaded.end(), true));
    if (count == 0 || count == pattern.size) return std::nullopt;
    LoadedPart part;
    std::vector<Index> number(pattern.size, -1);
    part.unknowns.reserve(count);
    for (Index j = 0; j < pattern.size; ++j) {
        if (!is_loaded[j]) continue;
        number[j] = static_cast<Index>(part.unknowns.size());
        part.unknowns.push_back(j);
    }
    part.pattern.size = count;
    part.pattern.column_starts.push_back(0);
    std::size_t most = 0;
    for (const Index j : part.unknowns) most += pattern.column_starts[j + 1] - pattern.column_starts[j];
    part.pattern.rows.resize(most);
    part.values.resize(most);
    Index to = 0;
    for (const Index j : part.unknowns) {
        for (Index k = pattern.column_starts[j]; k < pattern.column_starts[j + 1]; ++k) {
            const Index row = number[pattern.rows[k]];
            part.pattern.rows[to] = row;  // without a branch, which would be as good as random
            part.values[to] = values[k];
            to += row >= 0;
        }
        part.pattern.column_starts.push_back(to);
    }
    part.pattern.rows.resize(to);
    part.values.resize(to);
    return part;
}

}  // namespace magshell
