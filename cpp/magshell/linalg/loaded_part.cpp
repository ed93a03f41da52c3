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

template <Index count>
bool all_zero(const double* values) {
    bool any = false;
    for (Index k = 0; k < count; ++k) any |= values[k] != 0.0;
    return !any;
}

// The diagonal, and what else is not zero. Most is: counted first, what is kept needs little fresh memory.
LoadedPart without_zeros(const SparsePattern& pattern, std::span<const double> values) {
    Index count = 0;
    for (const double value : values) count += value != 0.0;
    LoadedPart all;
    all.pattern.size = pattern.size;
    all.pattern.column_starts.reserve(pattern.size + 1);
    all.pattern.column_starts.push_back(0);
    all.pattern.rows.resize(count + pattern.size + 1);  // what is passed over is written behind the last
    all.values.resize(count + pattern.size + 1);
    Index* const rows = all.pattern.rows.data();
    double* const kept = all.values.data();
    Index to = 0;
    for (Index j = 0; j < pattern.size; ++j) {
        Index k = pattern.column_starts[j];
        rows[to] = j;
        kept[to++] = values[k];
        const auto keep = [&] {
            rows[to] = pattern.rows[k];  // without a branch, which would be as good as random
            kept[to] = values[k];
            to += values[k] != 0.0;
        };
        const Index end = pattern.column_starts[j + 1];
        constexpr Index several = 8;  // zeros often stand together
        for (++k; k + several <= end;) {
            if (all_zero<several>(values.data() + k))
                k += several;
            else
                for (const Index last = k + several; k < last; ++k) keep();
        }
        for (; k < end; ++k) keep();
        all.pattern.column_starts.push_back(to);
    }
    all.pattern.rows.resize(to);
    all.values.resize(to);
    return all;
}

// Whether each unknown is coupled with a force.
std::vector<char> loaded(const SparsePattern& pattern, const VectorXd& forces) {
    Coupled coupled(pattern.size);
    for (Index j = 0; j < pattern.size; ++j) {
        Index first = coupled.first(j);
        for (Index k = pattern.column_starts[j] + 1; k < pattern.column_starts[j + 1]; ++k)
            if (!coupled.is_known(first, pattern.rows[k])) first = coupled.join(first, pattern.rows[k]);
    }
    std::vector<char> is_loaded(pattern.size, false);
    for (Index j = 0; j < pattern.size; ++j)
        if (forces[j] != 0.0) is_loaded[coupled.first(j)] = true;
    for (Index j = 0; j < pattern.size; ++j) is_loaded[j] = is_loaded[coupled.first(j)];
    return is_loaded;
}

// Columns are whole: what is coupled with one that is loaded is loaded.
LoadedPart columns_of(const LoadedPart& all, const std::vector<char>& is_loaded) {
    LoadedPart part;
    std::vector<Index> number(all.pattern.size, -1);
    for (Index j = 0; j < all.pattern.size; ++j) {
        if (!is_loaded[j]) continue;
        number[j] = static_cast<Index>(part.unknowns.size());
        part.unknowns.push_back(j);
    }
    part.pattern.size = static_cast<Index>(part.unknowns.size());
    part.pattern.column_starts.reserve(part.unknowns.size() + 1);
    part.pattern.column_starts.push_back(0);
    for (const Index j : part.unknowns) {
        const Index first = all.pattern.column_starts[j], end = all.pattern.column_starts[j + 1];
        for (Index k = first; k < end; ++k) part.pattern.rows.push_back(number[all.pattern.rows[k]]);
        part.values.insert(part.values.end(), all.values.begin() + first, all.values.begin() + end);
        part.pattern.column_starts.push_back(static_cast<Index>(part.pattern.rows.size()));
    }
    return part;
}

}  // namespace

LoadedPart loaded_part(const SparsePattern& pattern, std::span<const double> values, const VectorXd& forces) {
    LoadedPart all = without_zeros(pattern, values);
    if (!all_finite(all.values)) check_finite(values);
    const std::vector<char> is_loaded = loaded(all.pattern, forces);
    const auto count = std::count(is_loaded.begin(), is_loaded.end(), true);
    if (count > 0 && count < pattern.size) return columns_of(all, is_loaded);
    all.unknowns.resize(pattern.size);
    std::iota(all.unknowns.begin(), all.unknowns.end(), 0);
    return all;
}

}  // namespace magshell
