#include "magshell/assembly/node_matrix.h"

#include <algorithm>
#include <tuple>

namespace magshell {

void NodeMatrix::finish() {
    // Makes every diagonal entry present.
    for (Index point = 0; point < points_; ++point) entries_.push_back({point, point, 0.0});
    // A stable sort makes the sums independent of the sorting algorithm.
    std::stable_sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
        return std::tie(a.column, a.row) < std::tie(b.column, b.row);
    });
    column_starts_.assign(1, 0);
    rows_.clear();
    values_.clear();
    for (const Entry& entry : entries_) {
        const bool same_column = static_cast<Index>(column_starts_.size()) == entry.column + 2;
        if (!same_column) column_starts_.push_back(static_cast<Index>(rows_.size()));
        if (same_column && rows_.back() == entry.row) {
            values_.back() += entry.value;
        } else {
            rows_.push_back(entry.row);
            values_.push_back(entry.value);
        }
        column_starts_.back() = static_cast<Index>(rows_.size());
    }
    entries_ = {};
}

VectorXd NodeMatrix::times(const VectorXd& x) const {
    VectorXd y = VectorXd::Zero(x.size());
    for (Index j = 0; j < points_; ++j) {
        Index k = column_starts_[j];  // the diagonal entry
        const Vec3 own = x.segment<3>(3 * j);
        Vec3 sum = values_[k] * own;
        for (++k; k < column_starts_[j + 1]; ++k) {
            const Index i = rows_[k];
            sum += values_[k] * x.segment<3>(3 * i);
            y.segment<3>(3 * i) += values_[k] * own;
        }
        y.segment<3>(3 * j) += sum;
    }
    return y;
}

}  // namespace magshell
