#include "magshell/solve/constant_matrix.h"

#include <algorithm>
#include <string>

#include "magshell/core/errors.h"

namespace magshell {
namespace {

// More would make the dense part the larger one.
constexpr std::size_t most_special = 2000;

}  // namespace

ConstantMatrix::ConstantMatrix(const Model& model)
    : model_(model), version_(model.values_version()), stiffness_(model.surrogate()) {
    const Reduction& reduction = model.reduction();
    const std::vector<Index>& free = reduction.free_unknowns();
    const Index nodes = model.nodes().n_nodes();
    if (!free.empty() && free.back() >= 3 * nodes)
        throw InvalidInput("Projective Dynamics has no constant matrix for edge rotations");
    std::vector<Index> of_axis[3], place[3];
    for (Index k = 0; k < reduction.size(); ++k) {
        if (k >= static_cast<Index>(free.size()) || reduction.framed(free[k] / 3)) {
            special_.push_back(k);
            continue;
        }
        of_axis[free[k] % 3].push_back(free[k] / 3);
        place[free[k] % 3].push_back(k);
    }
    if (special_.size() > most_special)
        throw InvalidInput(
            "Projective Dynamics eliminates nodes that are held along slanted directions densely, and there "
            "are " +
            std::to_string(special_.size()) + " such unknowns: hold them along x, y or z, or entirely");
    for (int axis = 0; axis < 3; ++axis) {
        if (of_axis[axis].empty()) continue;
        const auto same = std::find_if(groups_.begin(), groups_.end(),
                                       [&](const Group& group) { return group.nodes == of_axis[axis]; });
        Group& group = same != groups_.end() ? *same : groups_.emplace_back();
        group.nodes = of_axis[axis];
        group.axes.push_back(axis);
        group.reduced.push_back(std::move(place[axis]));
    }
    for (Group& group : groups_) analyse(group);
    column_of_.assign(nodes, -1);
    if (groups_.size() == 1 && groups_[0].axes.size() == 3)
        for (std::size_t k = 0; k < groups_[0].nodes.size(); ++k)
            column_of_[groups_[0].nodes[k]] = static_cast<Index>(k);
}

bool ConstantMatrix::solves(Index node) const {
    if (groups_.size() != 1 || groups_[0].axes.size() != 3 || !special_.empty())
        throw InvalidInput(
            "Coulomb's law node by node is for scenes whose supports hold vertices entirely, and without "
            "rigid parts or "
            "skeletons");
    return column_of_[node] >= 0;
}

const VectorXd& ConstantMatrix::inverse_column(Index node) const {
    const auto known = inverse_columns_.find(node);
    if (known != inverse_columns_.end()) return known->second;
    Eigen::MatrixXd column = Eigen::MatrixXd::Zero(groups_[0].nodes.size(), 1);
    column(column_of_[node], 0) = 1.0;
    groups_[0].factor->solve(column);
    return inverse_columns_.emplace(node, column.col(0)).first->second;
}

double ConstantMatrix::inverse(Index row, Index column) const {
    return inverse_column(column)[column_of_[row]];
}

void ConstantMatrix::add_inverse_column(Index node, const Vec3& vector, VectorXd& full) const {
    const VectorXd& column = inverse_column(node);
    for (std::size_t k = 0; k < groups_[0].nodes.size(); ++k)
        full.segment<3>(3 * groups_[0].nodes[k]) += column[k] * vector;
}

void ConstantMatrix::analyse(Group& group) {
    std::vector<Index> column(stiffness_.nodes(), -1);
    for (std::size_t k = 0; k < group.nodes.size(); ++k) column[group.nodes[k]] = static_cast<Index>(k);
    auto pattern = std::make_shared<SparsePattern>();
    pattern->size = static_cast<Index>(group.nodes.size());
    pattern->column_starts.push_back(0);
    for (const Index node : group.nodes) {
        for (Index k = stiffness_.column_starts()[node]; k < stiffness_.column_starts()[node + 1]; ++k) {
            const Index row = column[stiffness_.rows()[k]];
            if (row < 0) continue;
            pattern->rows.push_back(row);
            group.from.push_back(k);
        }
        pattern->column_starts.push_back(static_cast<Index>(pattern->rows.size()));
    }
    std::vector<Vec3> points;
    for (const Index node : group.nodes) points.push_back(model_.nodes().rest[node]);
    group.factor = analyze(std::move(pattern), {.points = std::move(points)});
}

void ConstantMatrix::set(double scale, const VectorXd& weights, const VectorXd& of_nodes) {
    VectorXd sum = of_nodes;
    for (Index node = 0; node < sum.size(); ++node) sum[node] += weights[3 * node];
    bool same = scale == scale_ && sum == weights_;
    if (version_ != model_.values_version()) {  // perhaps of what does not enter
        version_ = model_.values_version();
        NodeMatrix now = model_.surrogate();
        same &= now.values() == stiffness_.values();
        stiffness_ = std::move(now);
    }
    if (same) return;
    scale_ = scale;
    weights_ = std::move(sum);
    factorize();
}

void ConstantMatrix::factorize() {
    linearized_ = false;
    inverse_columns_.clear();
    for (Group& group : groups_) {
        LargeVector<double>& values = group.factor->values();
        for (std::size_t k = 0; k < group.from.size(); ++k)
            values[k] = scale_ * stiffness_.values()[group.from[k]];
        const std::vector<Index>& starts = group.factor->pattern()->column_starts;
        for (std::size_t k = 0; k < group.nodes.size(); ++k) values[starts[k]] += weights_[group.nodes[k]];
        const FactorReport report = group.factor->factorize();
        ++factorizations_;
        if (!report.succeeded)
            throw InvalidInput("the constant matrix of Projective Dynamics: " + report.reason);
    }
}

VectorXd ConstantMatrix::times(const VectorXd& full) const {
    VectorXd product = VectorXd::Zero(full.size());
    const Index coordinates = 3 * stiffness_.nodes();
    product.head(coordinates) = scale_ * stiffness_.times(full.head(coordinates));
    for (Index node = 0; node < stiffness_.nodes(); ++node)
        product.segment<3>(3 * node) += weights_[node] * full.segment<3>(3 * node);
    return product;
}

void ConstantMatrix::linearize() {
    if (special_.empty() || (linearized_ && !model_.reduction().carries())) return;
    linearized_ = true;
    const Reduction& reduction = model_.reduction();
    const Eigen::Index count = static_cast<Eigen::Index>(special_.size());
    coupling_.resize(reduction.size(), count);
    Eigen::MatrixXd own(count, count);
    for (Eigen::Index k = 0; k < count; ++k) {
        VectorXd unit = VectorXd::Zero(reduction.size());
        unit[special_[k]] = 1.0;
        VectorXd image = reduction.vector(times(reduction.expand(unit)));
        for (Eigen::Index l = 0; l < count; ++l) {
            own(l, k) = image[special_[l]];
            image[special_[l]] = 0.0;
        }
        coupling_.col(k) = image;
    }
    const Eigen::MatrixXd forces = coupling_;
    for (Eigen::Index k = 0; k < count; ++k) {
        VectorXd column = coupling_.col(k);
        solve_plain(column);
        coupling_.col(k) = column;
    }
    schur_.compute(own - forces.transpose() * coupling_);
}

void ConstantMatrix::solve_plain(VectorXd& reduced) const {
    for (const Group& group : groups_) {
        Eigen::MatrixXd columns(group.nodes.size(), group.axes.size());
        for (std::size_t axis = 0; axis < group.axes.size(); ++axis)
            for (std::size_t k = 0; k < group.nodes.size(); ++k)
                columns(k, axis) = reduced[group.reduced[axis][k]];
        group.factor->solve(columns);
        for (std::size_t axis = 0; axis < group.axes.size(); ++axis)
            for (std::size_t k = 0; k < group.nodes.size(); ++k)
                reduced[group.reduced[axis][k]] = columns(k, axis);
    }
}

void ConstantMatrix::solve(VectorXd& reduced) const {
    if (special_.empty()) {
        solve_plain(reduced);
        return;
    }
    VectorXd of_special(special_.size());
    for (std::size_t k = 0; k < special_.size(); ++k) {
        of_special[k] = reduced[special_[k]];
        reduced[special_[k]] = 0.0;
    }
    of_special = schur_.solve(of_special - coupling_.transpose() * reduced).eval();
    solve_plain(reduced);
    reduced -= coupling_ * of_special;
    for (std::size_t k = 0; k < special_.size(); ++k) reduced[special_[k]] = of_special[k];
}

}  // namespace magshell
