#include "magshell/solve/projective/constant_matrix.h"

#include <algorithm>
#include <string>

#include "magshell/core/errors.h"

namespace magshell {
namespace {

// [-] Largest number of special dofs, whose dense Schur complement is factorized; see test_on_a_slanted_support_beside_edge_rotations.
constexpr std::size_t max_special_dofs = 2000;

}  // namespace

ConstantMatrix::ConstantMatrix(const Model& model)
    : model_(model),
      version_(model.parameters().version()),
      stiffness_(model.projective_stiffness()),
      normals_(stiffness_.scalars(), Vec3::UnitZ()) {
    const DofMap& dof_map = model.dof_map();
    const std::vector<Index>& free = dof_map.free_dofs();
    const Index scalars = 3 * stiffness_.nodes();
    std::vector<Index> of_axis[3], place[3], rotations;
    for (Index k = 0; k < dof_map.size(); ++k) {
        if (k < static_cast<Index>(free.size()) && free[k] >= scalars) {
            rotations.push_back(k);
            continue;
        }
        if (k >= static_cast<Index>(free.size()) || dof_map.is_rotated(free[k] / 3)) {
            special_.push_back(k);
            continue;
        }
        of_axis[free[k] % 3].push_back(free[k] / 3);
        place[free[k] % 3].push_back(k);
    }
    if (special_.size() > max_special_dofs)
        throw InvalidInput(
            "Projective Dynamics treats nodes that are held along slanted directions by a dense matrix, and "
            "this scene "
            "has " +
            std::to_string(special_.size()) + " such dofs, more than " + std::to_string(max_special_dofs) +
            ": hold the nodes along x, y or z, or entirely");
    for (int axis = 0; axis < 3; ++axis) {
        for (const Index k : rotations) {
            of_axis[axis].push_back(stiffness_.point(free[k] - scalars));
            place[axis].push_back(k);
        }
        if (of_axis[axis].empty()) continue;
        const auto same = std::find_if(groups_.begin(), groups_.end(),
                                       [&](const Group& group) { return group.points == of_axis[axis]; });
        Group& group = same != groups_.end() ? *same : groups_.emplace_back();
        group.points = of_axis[axis];
        group.axes.push_back(axis);
        group.reduced.push_back(std::move(place[axis]));
    }
    for (Group& group : groups_) {
        group.first = wide_size_;
        wide_size_ += group.count() * static_cast<Eigen::Index>(group.axes.size());
        analyse(group);
    }
}

void ConstantMatrix::require_isotropic() const {
    if (!special_.empty() || groups_.size() > 1 || (groups_.size() == 1 && groups_[0].axes.size() != 3))
        throw InvalidInput(
            "Coulomb contact in Projective Dynamics requires supports that hold vertices entirely, and a "
            "scene "
            "without rigid bodies or skeletons");
}

const VectorXd& ConstantMatrix::inverse_column(Group& group, Index column) const {
    const auto known = group.inverse_columns.find(column);
    if (known != group.inverse_columns.end()) return known->second;
    Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(group.count(), 1);
    unit(column, 0) = 1.0;
    group.factor->solve(unit);
    return group.inverse_columns.emplace(column, unit.col(0)).first->second;
}

void ConstantMatrix::analyse(Group& group) {
    group.column_of.assign(stiffness_.points(), -1);
    for (std::size_t k = 0; k < group.points.size(); ++k)
        group.column_of[group.points[k]] = static_cast<Index>(k);
    auto pattern = std::make_shared<SparsePattern>();
    pattern->size = static_cast<Index>(group.points.size());
    pattern->column_starts.push_back(0);
    for (const Index point : group.points) {
        for (Index k = stiffness_.column_starts()[point]; k < stiffness_.column_starts()[point + 1]; ++k) {
            const Index row = group.column_of[stiffness_.rows()[k]];
            if (row < 0) continue;
            pattern->rows.push_back(row);
            group.from.push_back(k);
        }
        pattern->column_starts.push_back(static_cast<Index>(pattern->rows.size()));
    }
    const std::vector<Vec3> all = model_.bodies().dof_points();
    std::vector<Vec3> points;
    for (const Index point : group.points)
        points.push_back(is_scalar(point) ? all[2 * stiffness_.nodes() + point] : model_.nodes().rest[point]);
    group.factor = analyze(std::move(pattern), {.points = std::move(points)});
}

void ConstantMatrix::set(double scale, const VectorXd& weights, const VectorXd& of_nodes) {
    VectorXd sum = VectorXd::Zero(stiffness_.points());
    for (Index node = 0; node < of_nodes.size(); ++node) sum[node] = of_nodes[node] + weights[3 * node];
    bool same = scale == scale_ && sum == weights_;
    if (version_ !=
        model_.parameters().version()) {  // the change may concern parameters that L does not depend on
        version_ = model_.parameters().version();
        NodeMatrix now = model_.projective_stiffness();
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
    for (Group& group : groups_) {
        group.inverse_columns.clear();
        LargeVector<double>& values = group.factor->values();
        for (std::size_t k = 0; k < group.from.size(); ++k)
            values[k] = scale_ * stiffness_.values()[group.from[k]];
        const std::vector<Index>& starts = group.factor->pattern()->column_starts;
        for (std::size_t k = 0; k < group.points.size(); ++k) values[starts[k]] += weights_[group.points[k]];
        const FactorReport report = group.factor->factorize();
        ++factorizations_;
        if (!report.succeeded)
            throw InvalidInput("the constant matrix of Projective Dynamics cannot be factorized: " +
                               report.reason);
    }
}

void ConstantMatrix::find_normals(const VectorXd& q) {
    for (Vec3& normal : normals_) normal.setZero();
    for (const NodeMatrix::AdjacentFace& each : stiffness_.adjacent_faces()) {
        const Vec3 x = q.segment<3>(3 * each.corners[0]);
        const Vec3 across =
            (q.segment<3>(3 * each.corners[1]) - x).cross(q.segment<3>(3 * each.corners[2]) - x);
        normals_[each.scalar] += across.normalized();
    }
    for (Vec3& normal : normals_)
        normal = normal.squaredNorm() > 0.0 ? Vec3(normal.normalized()) : Vec3(Vec3::UnitZ());
}

VectorXd ConstantMatrix::by_point(const VectorXd& full) const {
    VectorXd points(3 * stiffness_.points());
    const Index nodes = 3 * stiffness_.nodes();
    points.head(nodes) = full.head(nodes);
    for (Index s = 0; s < stiffness_.scalars(); ++s)
        points.segment<3>(nodes + 3 * s) = full[nodes + s] * normals_[s];
    return points;
}

VectorXd ConstantMatrix::times_points(const VectorXd& points) const {
    VectorXd product = scale_ * stiffness_.times(points);
    for (Index point = 0; point < stiffness_.points(); ++point)
        product.segment<3>(3 * point) += weights_[point] * points.segment<3>(3 * point);
    return product;
}

VectorXd ConstantMatrix::times(const VectorXd& full) const {
    const VectorXd points = times_points(by_point(full));
    const Index nodes = 3 * stiffness_.nodes();
    VectorXd product(full.size());
    product.head(nodes) = points.head(nodes);
    for (Index s = 0; s < stiffness_.scalars(); ++s)
        product[nodes + s] = normals_[s].dot(points.segment<3>(nodes + 3 * s));
    return product;
}

VectorXd ConstantMatrix::wide_of(const VectorXd& points) const {
    VectorXd out(wide_size_);
    for (const Group& group : groups_)
        for (std::size_t axis = 0; axis < group.axes.size(); ++axis)
            for (Eigen::Index k = 0; k < group.count(); ++k)
                out[group.first + static_cast<Eigen::Index>(axis) * group.count() + k] =
                    points[3 * group.points[k] + group.axes[axis]];
    return out;
}

VectorXd ConstantMatrix::wide(const VectorXd& reduced) const {
    VectorXd out(wide_size_);
    for (const Group& group : groups_)
        for (std::size_t axis = 0; axis < group.axes.size(); ++axis)
            for (Eigen::Index k = 0; k < group.count(); ++k) {
                const Index point = group.points[k];
                const double part = is_scalar(point) ? normal(point)[group.axes[axis]] : 1.0;
                out[group.first + static_cast<Eigen::Index>(axis) * group.count() + k] =
                    part * reduced[group.reduced[axis][k]];
            }
    return out;
}

void ConstantMatrix::narrow(const VectorXd& wide, VectorXd& reduced) const {
    if (stiffness_.scalars() > 0)
        for (const Group& group : groups_)
            for (Eigen::Index k = 0; k < group.count(); ++k)
                if (is_scalar(group.points[k])) reduced[group.reduced[0][k]] = 0.0;
    for (const Group& group : groups_)
        for (std::size_t axis = 0; axis < group.axes.size(); ++axis)
            for (Eigen::Index k = 0; k < group.count(); ++k) {
                const Index point = group.points[k];
                const double value = wide[group.first + static_cast<Eigen::Index>(axis) * group.count() + k];
                double& into = reduced[group.reduced[axis][k]];
                if (is_scalar(point))
                    into += normal(point)[group.axes[axis]] * value;
                else
                    into = value;
            }
}

void ConstantMatrix::solve_wide(VectorXd& wide) const {
    for (const Group& group : groups_) {
        Eigen::Map<Eigen::MatrixXd> columns(wide.data() + group.first, group.count(),
                                            static_cast<Eigen::Index>(group.axes.size()));
        group.factor->solve(columns);
    }
}

void ConstantMatrix::linearize(const VectorXd& q) {
    const bool turns = stiffness_.scalars() > 0;
    if (turns) find_normals(q);
    if (special_.empty() || (linearized_ && !turns && !model_.dof_map().has_reduced_coordinates())) return;
    linearized_ = true;
    const DofMap& dof_map = model_.dof_map();
    const Eigen::Index count = static_cast<Eigen::Index>(special_.size());
    forces_.resize(wide_size_, count);
    Eigen::MatrixXd own(count, count);
    for (Eigen::Index k = 0; k < count; ++k) {
        VectorXd unit = VectorXd::Zero(dof_map.size());
        unit[special_[k]] = 1.0;
        const VectorXd points = times_points(by_point(dof_map.expand(unit)));
        VectorXd image = VectorXd::Zero(model_.size());
        image.head(3 * stiffness_.nodes()) = points.head(3 * stiffness_.nodes());
        image = dof_map.vector(image);
        for (Eigen::Index l = 0; l < count; ++l) own(l, k) = image[special_[l]];
        forces_.col(k) = wide_of(points);
    }
    coupling_ = forces_;
    for (Eigen::Index k = 0; k < count; ++k) {
        VectorXd column = coupling_.col(k);
        solve_wide(column);
        coupling_.col(k) = column;
    }
    schur_.compute(own - forces_.transpose() * coupling_);
}

void ConstantMatrix::solve(VectorXd& reduced) const {
    VectorXd rest = wide(reduced), of_special(special_.size());
    for (std::size_t k = 0; k < special_.size(); ++k) of_special[k] = reduced[special_[k]];
    if (!special_.empty()) of_special = schur_.solve(of_special - coupling_.transpose() * rest).eval();
    solve_wide(rest);
    if (!special_.empty()) rest -= coupling_ * of_special;
    narrow(rest, reduced);
    for (std::size_t k = 0; k < special_.size(); ++k) reduced[special_[k]] = of_special[k];
}

Eigen::MatrixXd ConstantMatrix::compliance(const std::vector<Forces>& of) const {
    const Eigen::Index count = static_cast<Eigen::Index>(of.size());
    Eigen::MatrixXd product = Eigen::MatrixXd::Zero(count, count);
    Eigen::MatrixXd pushed(static_cast<Eigen::Index>(special_.size()), count);  // forces on the special dofs
    for (Eigen::Index k = 0; k < count && !special_.empty(); ++k) {
        VectorXd full = VectorXd::Zero(model_.size());
        for (int i = 0; i < of[k].count; ++i) full.segment<3>(3 * of[k].nodes[i]) += of[k].forces[i];
        const VectorXd reduced = model_.dof_map().vector(full);
        for (std::size_t l = 0; l < special_.size(); ++l) pushed(l, k) = reduced[special_[l]];
    }
    for (Group& group : groups_) {
        std::vector<Index> columns;  // of all loaded nodes, each once
        std::vector<std::array<Eigen::Index, 4>> at(of.size());
        std::map<Index, Eigen::Index> number;
        for (Eigen::Index k = 0; k < count; ++k)
            for (int i = 0; i < of[k].count; ++i) {
                const Index column = group.column_of[of[k].nodes[i]];
                at[k][i] = -1;
                if (column < 0) continue;
                const auto [found, fresh] = number.emplace(column, static_cast<Eigen::Index>(columns.size()));
                if (fresh) columns.push_back(column);
                at[k][i] = found->second;
            }
        const Eigen::Index pushed_columns = static_cast<Eigen::Index>(columns.size());
        Eigen::MatrixXd inverse(pushed_columns, pushed_columns);
        for (Eigen::Index c = 0; c < pushed_columns; ++c) {
            const VectorXd& column = inverse_column(group, columns[c]);
            for (Eigen::Index r = 0; r < pushed_columns; ++r) inverse(r, c) = column[columns[r]];
        }
        for (std::size_t a = 0; a < group.axes.size(); ++a) {
            const int axis = group.axes[a];
            const auto gather = [&](const auto& from, Eigen::Index k, auto&& into) {
                for (int i = 0; i < of[k].count; ++i)
                    if (at[k][i] >= 0) into += of[k].forces[i][axis] * from.row(at[k][i]);
            };
            Eigen::MatrixXd moved = Eigen::MatrixXd::Zero(count, pushed_columns);
            for (Eigen::Index k = 0; k < count; ++k) gather(inverse, k, moved.row(k));
            const Eigen::MatrixXd by_column = moved.transpose();
            for (Eigen::Index k = 0; k < count; ++k) gather(by_column, k, product.row(k));
            for (Eigen::Index k = 0; k < count && !special_.empty(); ++k)
                for (int i = 0; i < of[k].count; ++i)
                    if (at[k][i] >= 0)
                        pushed.col(k) -= of[k].forces[i][axis] *
                                         coupling_
                                             .row(group.first + static_cast<Eigen::Index>(a) * group.count() +
                                                  columns[at[k][i]])
                                             .transpose();
        }
    }
    if (!special_.empty()) product += pushed.transpose() * schur_.solve(pushed);
    return product;
}

}  // namespace magshell
