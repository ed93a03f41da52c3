#include "magshell/linalg/loaded_part.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

#include "magshell/linalg/pattern_checks.h"

namespace magshell {
namespace {

// Disjoint sets of coupled unknowns, each represented by its first (union-find).
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

    /// Merges two sets and returns the first unknown of both.
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
    std::uint64_t bits = 0;
    for (Index k = 0; k < count; ++k) bits |= std::bit_cast<std::uint64_t>(values[k]);
    return bits << 1 == 0;  // ignoring the signs of zeros
}

// For each column, the rows below the diagonal whose entries are not zero.
struct Coupling {
    std::vector<Index> starts, rows;

    std::span<const Index> of(Index column) const {
        return {rows.data() + starts[column], rows.data() + starts[column + 1]};
    }
};

Coupling coupling_of(const SparsePattern& pattern, std::span<const double> values) {
    Index count = 0;  // most entries are zero, so little fresh memory is needed
    bool all_finite = true;
    for (const double value : values) {
        count += value != 0.0;
        all_finite &= std::abs(value) <= std::numeric_limits<double>::max();
    }
    if (!all_finite) check_finite(values);
    // entries that are skipped are written behind the last one
    Coupling coupling{{0}, std::vector<Index>(count + 1)};
    coupling.starts.reserve(pattern.size + 1);
    Index to = 0;
    for (Index j = 0; j < pattern.size; ++j) {
        constexpr Index several = 8;  // [entries] tested at once: zeros often stand together; plain-words: ok
        Index k = pattern.column_starts[j] + 1;
        const Index end = pattern.column_starts[j + 1];
        while (k < end) {
            if (k + several <= end && all_zero<several>(values.data() + k)) {
                k += several;
                continue;
            }
            for (const Index last = std::min(k + several, end); k < last; ++k) {
                coupling.rows[to] = pattern.rows[k];  // without a branch, which would be unpredictable
                to += values[k] != 0.0;
            }
        }
        coupling.starts.push_back(to);
    }
    return coupling;
}

// Returns for each unknown whether it is coupled with a force; true for all if there is no force.
std::vector<char> loaded(const Coupling& coupling, const VectorXd& forces) {
    const Index size = static_cast<Index>(forces.size());
    Coupled coupled(size);
    for (Index j = 0; j < size; ++j) {
        Index first = coupled.first(j);
        for (const Index row : coupling.of(j))
            if (!coupled.is_known(first, row)) first = coupled.join(first, row);
    }
    std::vector<char> is_loaded(size, false);
    bool any = false;
    for (Index j = 0; j < size; ++j) {
        if (forces[j] == 0.0) continue;
        is_loaded[coupled.first(j)] = true;
        any = true;
    }
    for (Index j = 0; j < size; ++j) is_loaded[j] = !any || is_loaded[coupled.first(j)];
    return is_loaded;
}

// Returns the first unknown of each node: chosen unknowns that follow each other and have the same rows below
// belong to one node.
std::vector<Index> nodes_of(const SparsePattern& pattern, const std::vector<char>& is_chosen) {
    std::vector<Index> node(pattern.size);
    for (Index j = 0; j < pattern.size; ++j) {
        node[j] = j;
        if (j == 0 || !is_chosen[j] || !is_chosen[j - 1]) continue;
        const auto rows = pattern.rows.begin(), before = rows + pattern.column_starts[j - 1] + 1,
                   own = rows + pattern.column_starts[j], end = rows + pattern.column_starts[j + 1];
        if (own - before == end - own && std::equal(own, end, before)) node[j] = node[j - 1];
    }
    return node;
}

// Extracts the columns and rows of some unknowns.
class Selection {
  public:
    Selection(const SparsePattern& pattern, const double* values, const Coupling& coupling,
              const std::vector<char>& is_chosen)
        : from_(pattern),
          values_(values),
          coupling_(coupling),
          node_(nodes_of(pattern, is_chosen)),
          coupled_(pattern.size, -1),
          number_(pattern.size, -1) {
        for (Index j = 0; j < pattern.size; ++j) {
            if (!is_chosen[j]) continue;
            number_[j] = static_cast<Index>(part_.unknowns.size());
            part_.unknowns.push_back(j);
        }
        part_.pattern.size = static_cast<Index>(part_.unknowns.size());
        part_.pattern.column_starts.reserve(part_.unknowns.size() + 1);
        part_.pattern.column_starts.push_back(0);
        std::size_t most = 0;
        for (const Index j : part_.unknowns) most += pattern.column_starts[j + 1] - pattern.column_starts[j];
        part_.pattern.rows.reserve(most);
        part_.values.reserve(most);
        for (Index first = 0, end = 0; first < pattern.size; first = end) {
            while (end < pattern.size && node_[end] == first) ++end;
            add_node(first, end);
        }
    }
    LoadedPart&& take() { return std::move(part_); }

  private:
    // Adds the columns of a node: all rows within the node, and the same rows below for each column.
    void add_node(Index first, Index end) {
        if (number_[first] < 0) return;
        const Index count = choose_below(first, end);
        for (Index column = first; column < end; ++column) {
            const Index own = from_.column_starts[column];
            for (Index row = column; row < end; ++row) part_.pattern.rows.push_back(number_[row]);
            part_.values.insert(part_.values.end(), values_ + own, values_ + own + end - column);
            part_.pattern.rows.insert(part_.pattern.rows.end(), below_.begin(), below_.begin() + count);
            const double* const values = values_ + own + end - column;
            for (Index k = 0; k < count; ++k) part_.values.push_back(values[places_[k]]);
            part_.pattern.column_starts.push_back(static_cast<Index>(part_.pattern.rows.size()));
        }
    }

    // Collects the rows below a node that belong to nodes coupled with it; returns their number.
    Index choose_below(Index node, Index end) {
        for (Index column = node; column < end; ++column)
            for (const Index row : coupling_.of(column)) coupled_[node_[row]] = node;
        const Index below = from_.column_starts[end - 1] + 1, count = from_.column_starts[end] - below;
        const Index* const rows = from_.rows.data() + below;
        if (static_cast<Index>(places_.size()) <= count) {
            places_.resize(count + 1);
            below_.resize(count + 1);
        }
        Index to = 0;
        for (Index k = 0; k < count; ++k) {
            const Index row = rows[k];
            places_[to] = k;
            below_[to] = number_[row];
            to += (coupled_[node_[row]] == node) & (number_[row] >= 0);
        }
        return to;
    }

    const SparsePattern& from_;
    const double* const values_;
    const Coupling& coupling_;
    const std::vector<Index> node_;
    std::vector<Index> coupled_;         // of each node: the last node that it is coupled with
    std::vector<Index> number_;          // new number of each unknown, or -1
    std::vector<Index> places_, below_;  // rows below: their position in each column, and their new numbers
    LoadedPart part_;
};

}  // namespace

LoadedPart loaded_part(const SparsePattern& pattern, std::span<const double> values, const VectorXd& forces) {
    const Coupling coupling = coupling_of(pattern, values);
    return Selection(pattern, values.data(), coupling, loaded(coupling, forces)).take();
}

}  // namespace magshell
