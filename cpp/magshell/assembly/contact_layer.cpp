#include "magshell/assembly/contact_layer.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace magshell {

bool ContactLayer::couples(const Group& group) const {
    for (int i = 0; i < 4 && group[i] >= 0; ++i)
        for (int j = 0; j < i; ++j)
            if (!matrix_.couples(group[i], group[j])) return false;
    return true;
}

void ContactLayer::add_couplings(std::vector<Group> groups) {
    // [-] Largest number of groups that are kept, over those needed now; fixed by test_contact_that_opens_and_closes_in_every_step.
    constexpr std::size_t too_many = 3;
    std::sort(groups.begin(), groups.end());
    groups.erase(std::unique(groups.begin(), groups.end()), groups.end());
    std::vector<Group> all;
    all.reserve(groups_.size() + groups.size());
    std::set_union(groups_.begin(), groups_.end(), groups.begin(), groups.end(), std::back_inserter(all));
    groups_ = all.size() > too_many * groups.size() ? std::move(groups) : std::move(all);
    std::vector<Clique> cliques;
    cliques.reserve(groups_.size());
    for (const Group& group : groups_) cliques.push_back({group});
    matrix_ = SystemMatrix(matrix_.nodes(), matrix_.rotations(), {}, cliques);
    ++version_;
}

void merge(const SystemMatrix& matrix, const SystemMatrix* layer, std::vector<Index>& column_starts,
           std::vector<Index>& rows, LargeVector<double>& values) {
    if (!layer) {
        column_starts = matrix.column_starts();
        rows = matrix.rows();
        values = matrix.values();
        return;
    }
    column_starts.assign(1, 0);
    rows.clear();
    values.clear();
    for (Index column = 0; column < matrix.size(); ++column) {
        each_entry(matrix, layer, column, [&](Index row, Index k, Index l) {
            rows.push_back(row);
            values.push_back((k >= 0 ? matrix.values()[k] : 0.0) + (l >= 0 ? layer->values()[l] : 0.0));
        });
        column_starts.push_back(static_cast<Index>(rows.size()));
    }
}

}  // namespace magshell
