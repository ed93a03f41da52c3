#include "magshell/dofs/linear_ties.h"

#include <algorithm>
#include <utility>

#include "magshell/core/errors.h"

namespace magshell {
namespace {

Index position_of(const SparsePattern& pattern, Index a, Index b) {
    const Index column = std::min(a, b), row = std::max(a, b);
    const auto first = pattern.rows.begin() + pattern.column_starts[column],
               last = pattern.rows.begin() + pattern.column_starts[column + 1];
    return static_cast<Index>(std::lower_bound(first, last, row) - pattern.rows.begin());
}

}  // namespace

LinearTies::LinearTies(std::vector<TiedDof> tied, Index full_size)
    : ReducedCoordinates({}), tied_(std::move(tied)), tied_at_(full_size, -1) {
    for (std::size_t k = 0; k < tied_.size(); ++k) tied_at_[tied_[k].dof] = static_cast<Index>(k);
    for (const TiedDof& each : tied_)
        for (const TiedDof::Part& part : each.parts)
            if (is_tied(part.dof)) throw InvalidInput("a dof is tied to one that is tied itself");
}

void LinearTies::extend(VectorXd& motion) const {
    for (const TiedDof& each : tied_) {
        double sum = 0.0;
        for (const TiedDof::Part& part : each.parts) sum += part.weight * motion[part.dof];
        motion[each.dof] = sum;
    }
}

// x_s = X_s + sum_j w_j (x_j - X_j) + ...
void LinearTies::add_rest_gradient(const VectorXd& by_dofs, VectorXd& out) const {
    for (const TiedDof& each : tied_) {
        out[each.dof] += by_dofs[each.dof];
        for (const TiedDof::Part& part : each.parts) out[part.dof] -= part.weight * by_dofs[each.dof];
    }
}

void LinearTies::gather(VectorXd& forces) const {
    for (const TiedDof& each : tied_)
        for (const TiedDof::Part& part : each.parts) forces[part.dof] += part.weight * forces[each.dof];
}

void LinearTies::gather(const VectorXd& forces, VectorXd& reduced) const {
    for (const TiedDof& each : tied_)
        for (const TiedDof::Part& part : each.parts)
            if (reduced_[part.dof] >= 0) reduced[reduced_[part.dof]] += part.weight * forces[each.dof];
}

LinearTies::ReducedParts LinearTies::parts_of(Index dof) const {
    if (!is_tied(dof)) return reduced_[dof] < 0 ? ReducedParts() : ReducedParts{{reduced_[dof], 1.0}};
    ReducedParts parts;
    for (const TiedDof::Part& part : tied_[tied_at_[dof]].parts)
        if (reduced_[part.dof] >= 0) parts.push_back({reduced_[part.dof], part.weight});
    return parts;
}

void LinearTies::collect_couplings(const std::vector<const SystemMatrix*>& matrices,
                                   const std::vector<Index>& reduced) {
    reduced_ = reduced;
    extra_rows_.clear();
    std::set<Index> group;
    std::map<Index, std::set<Index>> cliques;
    const auto couple = [](std::map<Index, std::set<Index>>& rows, const ReducedParts& a,
                           const ReducedParts& b) {
        for (const TiedDof::Part& one : a)
            for (const TiedDof::Part& other : b)
                rows[std::min(one.dof, other.dof)].insert(std::max(one.dof, other.dof));
    };
    for (const SystemMatrix* matrix : matrices)
        for (Index column = 0; column < matrix->size(); ++column)
            for (Index k = matrix->column_starts()[column]; k < matrix->column_starts()[column + 1]; ++k) {
                const Index row = matrix->rows()[k];
                if (is_tied(row) || is_tied(column)) couple(extra_rows_, parts_of(row), parts_of(column));
            }
    for (const TiedDof& each : tied_) {
        const ReducedParts parts = parts_of(each.dof);
        couple(extra_rows_, parts, parts);
        couple(cliques, parts, parts);
        for (const TiedDof::Part& part : parts) group.insert(part.dof);
    }

    group_.assign(group.begin(), group.end());
    group_dofs_.clear();
    SparsePattern pattern;
    pattern.size = static_cast<Index>(group_.size());
    pattern.column_starts.push_back(0);
    const auto within = [&](Index free) {
        return static_cast<Index>(std::ranges::lower_bound(group_, free) - group_.begin());
    };
    std::map<Index, Index> dofs;  // by free dof
    for (const TiedDof& each : tied_)
        for (const TiedDof::Part& part : each.parts) dofs[reduced[part.dof]] = part.dof;
    for (const Index free : group_) {
        group_dofs_.push_back(dofs[free]);
        for (const Index row : cliques[free]) pattern.rows.push_back(within(row));
        pattern.column_starts.push_back(static_cast<Index>(pattern.rows.size()));
    }
    group_entries_.clear();
    for (const TiedDof& each : tied_) {
        const ReducedParts parts = parts_of(each.dof);
        for (const TiedDof::Part& a : parts)
            for (const TiedDof::Part& b : parts)
                if (a.dof >= b.dof)
                    group_entries_.push_back(
                        {each.dof, position_of(pattern, within(a.dof), within(b.dof)), a.weight * b.weight});
    }
    if (!group_pattern_ || *group_pattern_ != pattern) {
        group_pattern_ = std::make_shared<const SparsePattern>(std::move(pattern));
        factor_.reset();
    }
}

const std::set<Index>& LinearTies::rows_of(Index column, const std::set<Index>& none) const {
    const auto found = extra_rows_.find(column);
    return found == extra_rows_.end() ? none : found->second;
}

void LinearTies::find_entries(const std::vector<const SystemMatrix*>& matrices,
                              const SparsePattern& pattern) {
    entries_.assign(matrices.size(), {});
    for (std::size_t which = 0; which < matrices.size(); ++which) {
        const SystemMatrix& matrix = *matrices[which];
        for (Index column = 0; column < matrix.size(); ++column)
            for (Index k = matrix.column_starts()[column]; k < matrix.column_starts()[column + 1]; ++k) {
                const Index row = matrix.rows()[k];
                if (!is_tied(row) && !is_tied(column)) continue;
                // An entry off the diagonal stands for its transpose as well.
                for (const TiedDof::Part& a : parts_of(row))
                    for (const TiedDof::Part& b : parts_of(column)) {
                        if (row == column && a.dof < b.dof) continue;
                        const double twice = row != column && a.dof == b.dof ? 2.0 : 1.0;
                        entries_[which].push_back(
                            {k, position_of(pattern, a.dof, b.dof), twice * a.weight * b.weight});
                    }
            }
    }
    weights_.clear();
    for (const TiedDof& each : tied_) {
        const ReducedParts parts = parts_of(each.dof);
        for (const TiedDof::Part& a : parts)
            for (const TiedDof::Part& b : parts)
                if (a.dof >= b.dof)
                    weights_.push_back({each.dof, position_of(pattern, a.dof, b.dof), a.weight * b.weight});
    }
    extra_rows_.clear();
}

void LinearTies::add_matrix(std::size_t which, const SystemMatrix& full, double* values) const {
    const double* from = full.values().data();
    for (const Entry& entry : entries_[which]) values[entry.to] += entry.weight * from[entry.from];
}

void LinearTies::add_weights(const VectorXd& weights, double* values) const {
    for (const Entry& entry : weights_) values[entry.to] += entry.weight * weights[entry.from];
}

void LinearTies::add_diagonal(const VectorXd& weights, VectorXd& reduced) const {
    for (const TiedDof& each : tied_)
        for (const TiedDof::Part& part : parts_of(each.dof))
            reduced[part.dof] += part.weight * part.weight * weights[each.dof];
}

void LinearTies::solve(const VectorXd& weights, const VectorXd& forces, VectorXd& z) const {
    if (group_.empty()) return;
    VectorXd diagonal = VectorXd::Zero(z.size());
    for (std::size_t k = 0; k < group_.size(); ++k) diagonal[group_[k]] = weights[group_dofs_[k]];
    add_diagonal(weights, diagonal);
    if (!factor_ || factorized_ != weights) {
        if (!factor_) factor_ = analyze(group_pattern_);
        LargeVector<double>& values = factor_->values();
        std::fill(values.begin(), values.end(), 0.0);
        const std::vector<Index>& starts = group_pattern_->column_starts;
        for (std::size_t k = 0; k < group_.size(); ++k)
            values[starts[k]] = diagonal[group_[k]] != 0.0 ? weights[group_dofs_[k]] : 1.0;
        for (const Entry& entry : group_entries_) values[entry.to] += entry.weight * weights[entry.from];
        if (const FactorReport report = factor_->factorize(); !report.succeeded)
            throw InvalidInput("the masses of tied vertices cannot be inverted: " + report.reason);
        factorized_ = weights;
    }
    VectorXd solution(group_.size());
    for (std::size_t k = 0; k < group_.size(); ++k)
        solution[static_cast<Index>(k)] = diagonal[group_[k]] != 0.0 ? forces[group_[k]] : 0.0;
    factor_->solve(solution);
    for (std::size_t k = 0; k < group_.size(); ++k) z[group_[k]] = solution[static_cast<Index>(k)];
}

std::size_t LinearTies::bytes() const {
    std::size_t total = (tied_at_.capacity() + reduced_.capacity()) * sizeof(Index) +
                        (weights_.capacity() + group_entries_.capacity()) * sizeof(Entry);
    for (const std::vector<Entry>& entries : entries_) total += entries.capacity() * sizeof(Entry);
    for (const TiedDof& each : tied_)
        total += each.parts.capacity() * sizeof(TiedDof::Part) + sizeof(TiedDof);
    return total + (factor_ ? factor_->bytes() : 0);
}

}  // namespace magshell
