#include "magshell/dofs/reduced_assembly.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "magshell/core/errors.h"

namespace magshell {

using Eigen::MatrixXd;

ReducedAssembly::ReducedAssembly(ReducedCoordinatesList maps, const SystemMatrix& matrix)
    : system_of_(matrix.size(), -1), row_of_(matrix.size(), -1) {
    for (std::unique_ptr<ReducedCoordinates>& map : maps) {
        if (LinearTies* ties = dynamic_cast<LinearTies*>(map.get())) {
            if (maps.size() > 1)
                throw InvalidInput("ties of displacements cannot be combined with rigid bodies yet");
            ties_ = std::make_unique<LinearTies>(std::move(*ties));
            continue;
        }
        System& system = systems_.emplace_back();
        system.map = std::move(map);
        system.first = coordinates_;
        coordinates_ += system.map->coordinates();
        has_motors_ |= system.map->n_motor_coordinates() > 0;
        has_joint_parameters_ |= system.map->has_joint_parameters();
        Index row = 0;
        for (const Index node : system.map->nodes())
            for (int c = 0; c < 3; ++c) {
                system_of_[3 * node + c] = static_cast<Index>(systems_.size()) - 1;
                row_of_[3 * node + c] = row++;
            }
    }
}

void ReducedAssembly::collect_couplings(const std::vector<const SystemMatrix*>& matrices,
                                        const std::vector<Index>& reduced, Index free) {
    n_free_ = free;
    if (ties_) return ties_->collect_couplings(matrices, reduced);
    for (System& system : systems_) system.later.clear();
    for (const SystemMatrix* matrix : matrices)
        for (Index column = 0; column < matrix->size(); ++column)
            for (Index k = matrix->column_starts()[column]; k < matrix->column_starts()[column + 1]; ++k) {
                const Index row = matrix->rows()[k], of_row = system_of_[row], of_column = system_of_[column];
                if (of_row >= 0 && reduced[column] >= 0) coupled_[reduced[column]].insert(of_row);
                if (of_column >= 0 && reduced[row] >= 0) coupled_[reduced[row]].insert(of_column);
                if (of_row >= 0 && of_column >= 0 && of_row != of_column)
                    systems_[std::min(of_row, of_column)].later.insert(std::max(of_row, of_column));
            }
}

void ReducedAssembly::append_rows(Index free, std::vector<Index>& rows) const {
    const auto found = coupled_.find(free);
    if (found == coupled_.end()) return;
    for (const Index each : found->second)
        for (Index j = 0; j < systems_[each].map->coordinates(); ++j)
            rows.push_back(n_free_ + systems_[each].first + j);
}

void ReducedAssembly::append_columns(SparsePattern& pattern) const {
    for (const System& system : systems_)
        for (Index j = 0; j < system.map->coordinates(); ++j) {
            for (Index i = j; i < system.map->coordinates(); ++i)
                pattern.rows.push_back(n_free_ + system.first + i);
            for (const Index other : system.later)
                for (Index i = 0; i < systems_[other].map->coordinates(); ++i)
                    pattern.rows.push_back(n_free_ + systems_[other].first + i);
            pattern.column_starts.push_back(static_cast<Index>(pattern.rows.size()));
        }
}

namespace {

Index position_in(const SparsePattern& pattern, Index column, Index row) {
    Index k = pattern.column_starts[column];
    while (pattern.rows[k] != row) ++k;
    return k;
}

// Returns B^T B.
MatrixXd normal_of(const LinkTwists& b) {
    return b.product(VectorXd::Ones(b.rows()));
}

// Returns the coordinates z, including those of motors, of the motion B z nearest to a motion of the nodes (least squares).
VectorXd coordinates_of(const LinkTwists& b, const VectorXd& rows) {
    return normal_of(b).ldlt().solve(b.pull_back(rows));
}

}  // namespace

void ReducedAssembly::find_entries(const std::vector<const SystemMatrix*>& matrices,
                                   const std::vector<Index>& reduced, const SparsePattern& pattern) {
    if (ties_) return ties_->find_entries(matrices, pattern);
    for (System& system : systems_) {
        system.own.clear();
        system.across_rows.clear();
        system.entries.assign(matrices.size(), {});
        for (const Index other : system.later) system.across_rows[other] = {};
        for (Index j = 0; j < system.map->coordinates(); ++j) {
            const Index column = n_free_ + system.first + j;
            system.own.push_back(position_in(pattern, column, column));
            for (const Index other : system.later)
                if (systems_[other].map->coordinates() > 0)
                    system.across_rows[other].push_back(
                        position_in(pattern, column, n_free_ + systems_[other].first));
        }
    }
    for (std::size_t which = 0; which < matrices.size(); ++which)
        find_entries(which, *matrices[which], reduced, pattern);
    coupled_.clear();
}

void ReducedAssembly::find_entries(std::size_t which, const SystemMatrix& matrix,
                                   const std::vector<Index>& reduced, const SparsePattern& pattern) {
    struct Mixed {
        Index map, to, link, from, row;
    };
    std::vector<Mixed> mixed;
    const auto of = [&](Index map) -> Entries& { return systems_[map].entries[which]; };
    const auto link = [&](Index unknown) {
        return systems_[system_of_[unknown]].twists.link_of_row(row_of_[unknown]);
    };
    const auto add_mixed = [&](Index free, Index carried, Index k) {
        const Index map = system_of_[carried];
        if (systems_[map].map->coordinates() == 0) return;  // all of its coordinates are fixed or prescribed
        const Index to = position_in(pattern, reduced[free], n_free_ + systems_[map].first);
        mixed.push_back({map, to, link(carried), k, row_of_[carried]});
    };
    for (Index column = 0; column < matrix.size(); ++column)
        for (Index k = matrix.column_starts()[column]; k < matrix.column_starts()[column + 1]; ++k) {
            const Index row = matrix.rows()[k], of_row = system_of_[row], of_column = system_of_[column];
            if (of_row >= 0 && of_column >= 0) {
                if (of_row < of_column)
                    of(of_row).across[of_column].add(k, row_of_[column], link(column), row_of_[row],
                                                     link(row), 1.0);
                else if (of_row > of_column)
                    of(of_column).across[of_row].add(k, row_of_[row], link(row), row_of_[column],
                                                     link(column), 1.0);
                else  // the lower half stands for both
                    of(of_row).inner.add(k, row_of_[row], link(row), row_of_[column], link(column),
                                         row == column ? 0.5 : 1.0);
            } else if (of_row >= 0 && reduced[column] >= 0)
                add_mixed(column, row, k);
            else if (of_column >= 0 && reduced[row] >= 0)
                add_mixed(row, column, k);
        }
    std::ranges::sort(mixed, {}, [](const Mixed& m) { return std::tuple(m.map, m.to, m.link, m.from); });
    for (const Mixed& each : mixed) of(each.map).mixed.add(each.from, each.row, each.link, each.to);
}

void ReducedAssembly::linearize(const VectorXd& q) {
    state_ = q;
    for (System& system : systems_) {
        system.twists = system.map->twists(q);
        system.normal.reset();
    }
}

void ReducedAssembly::add_lower(const System& system, const MatrixXd& block, double* values) const {
    for (Index j = 0; j < block.cols(); ++j)
        for (Index i = j; i < block.rows(); ++i) values[system.own[j] + i - j] += block(i, j);
}

void ReducedAssembly::add_matrix(std::size_t which, const SystemMatrix& full, double* values) const {
    if (ties_) return ties_->add_matrix(which, full, values);
    const double* entries = full.values().data();
    for (const System& system : systems_) {
        const Entries& of = system.entries[which];
        const LinkTwists& b = system.twists;
        const Index n = system.map->coordinates();
        of.mixed.add_columns(entries, b, n, values);
        if (!of.inner.empty()) {
            const MatrixXd half = b.product(of.inner.blocks(entries, b, b), b).topLeftCorner(n, n);
            add_lower(system, half + half.transpose(), values);
        }
        for (const auto& [other, across] : of.across) {
            const LinkTwists& next = systems_[other].twists;
            const MatrixXd block = b.product(across.blocks(entries, next, b), next);
            const std::vector<Index>& to = system.across_rows.at(other);
            if (to.empty()) continue;
            for (Index j = 0; j < n; ++j)
                for (Index i = 0; i < systems_[other].map->coordinates(); ++i)
                    values[to[j] + i] += block(i, j);
        }
    }
}

void ReducedAssembly::add_weights(const VectorXd& weights, double* values) const {
    if (ties_) ties_->add_weights(weights, values);
    for (const System& system : systems_) {
        const Index n = system.map->coordinates();
        add_lower(system, system.twists.product(system.map->gather(weights)).topLeftCorner(n, n), values);
    }
}

void ReducedAssembly::add_curvature(const VectorXd& gradient, double* values) const {
    for (const System& system : systems_) {
        const Index n = system.map->coordinates();
        add_lower(system, system.map->curvature(state_, gradient).topLeftCorner(n, n), values);
    }
}

void ReducedAssembly::add_curvature_product(const VectorXd& gradient, const VectorXd& reduced,
                                            VectorXd& out) const {
    for (const System& system : systems_) {
        const Index n = system.map->coordinates(), first = n_free_ + system.first;
        out.segment(first, n) +=
            system.map->curvature(state_, gradient).topLeftCorner(n, n) * reduced.segment(first, n);
    }
}

std::vector<const RigidNodes*> ReducedAssembly::free_bodies() const {
    std::vector<const RigidNodes*> found;
    for (const System& system : systems_) {
        const std::vector<const RigidNodes*> own = system.map->free_bodies();
        found.insert(found.end(), own.begin(), own.end());
    }
    return found;
}

void ReducedAssembly::set_values(const Values& values) {
    for (System& system : systems_) system.map->set_values(values);
}

void ReducedAssembly::add_motor_increment(const VectorXd& q, VectorXd& increment) const {
    for (const System& system : systems_) {
        if (system.map->n_motor_coordinates() == 0) continue;
        const VectorXd z = system.map->motor_increment(q);
        if (z.isZero(0.0)) continue;
        system.map->scatter(system.map->twists(q).motion_from(system.map->coordinates(), z), increment);
    }
}

const Eigen::LDLT<MatrixXd>& ReducedAssembly::normal_matrix(const System& system) {
    const Index n = system.map->coordinates();
    if (!system.normal) system.normal.emplace(normal_of(system.twists).topLeftCorner(n, n));
    return *system.normal;
}

VectorXd ReducedAssembly::pull_back_free(const System& system, const VectorXd& rows) {
    return system.twists.pull_back(rows).head(system.map->coordinates());
}

VectorXd ReducedAssembly::pull_back_motors(const System& system, const VectorXd& rows) {
    return system.twists.pull_back(rows).tail(system.map->n_motor_coordinates());
}

VectorXd ReducedAssembly::free_part(const System& system, const VectorXd& full) const {
    return normal_matrix(system).solve(pull_back_free(system, system.map->gather(full)));
}

VectorXd ReducedAssembly::motor_part(const System& system, const VectorXd& full) const {
    return coordinates_of(system.twists, system.map->gather(full)).tail(system.map->n_motor_coordinates());
}

void ReducedAssembly::add_motor_increment_forces(const VectorXd& gradient, const VectorXd& move,
                                                 VectorXd& forces) const {
    for (const System& system : systems_) {
        const Index n = system.map->coordinates(), m = system.map->n_motor_coordinates();
        if (m == 0 || n == 0) continue;
        add_nodal_forces(
            system, system.map->curvature(state_, gradient).topRightCorner(n, m) * motor_part(system, move),
            forces);
    }
}

void ReducedAssembly::add_nodal_forces(const System& system, const VectorXd& by_coordinates,
                                       VectorXd& forces) const {
    VectorXd own = system.map->gather(forces);
    own += system.twists.motion(normal_matrix(system).solve(by_coordinates));
    system.map->scatter(own, forces);
}

VectorXd ReducedAssembly::motor_rates(const System& system, const VectorXd& all, Index& first) {
    const Index m = system.map->n_motor_coordinates();
    if (m == 0) return {};
    first += m;
    return system.map->motor_units().cwiseProduct(all.segment(first - m, m));
}

VectorXd ReducedAssembly::motor_motion(const VectorXd& by_motor_forces) const {
    VectorXd motion = VectorXd::Zero(state_.size());
    Index first = 0;
    for (const System& system : systems_)
        if (const VectorXd z = motor_rates(system, by_motor_forces, first); z.size() > 0)
            system.map->scatter(system.twists.motion_from(system.map->coordinates(), z), motion);
    return motion;
}

void ReducedAssembly::add_motor_force_change(const VectorXd& gradient, const VectorXd& by_motor_forces,
                                             VectorXd& forces) const {
    Index first = 0;
    for (const System& system : systems_) {
        const VectorXd z = motor_rates(system, by_motor_forces, first);
        const Index n = system.map->coordinates();
        if (z.size() > 0 && n > 0)
            add_nodal_forces(system, system.map->motor_force_change(state_, gradient, z).head(n), forces);
    }
}

VectorXd ReducedAssembly::adjoint_rates(const System& system, const VectorXd& lambda,
                                        const VectorXd& by_motor_forces, Index& first) const {
    const Index n = system.map->coordinates(), m = system.map->n_motor_coordinates();
    VectorXd z = VectorXd::Zero(n + m);
    if (n > 0) z.head(n) = free_part(system, lambda);
    if (by_motor_forces.size() > 0 && m > 0) z.tail(m) = motor_rates(system, by_motor_forces, first);
    return z;
}

void ReducedAssembly::rest_vjp(const VectorXd& by_state, const VectorXd& lambda, const VectorXd& gradient,
                               const VectorXd& by_motor_forces, VectorXd& by_nodes) const {
    Index first = 0;
    for (const System& system : systems_)
        system.map->rest_vjp(state_, by_state, adjoint_rates(system, lambda, by_motor_forces, first),
                             gradient, by_nodes);
}

void ReducedAssembly::vjp(const VectorXd& by_state, const VectorXd& lambda, const VectorXd& gradient,
                          const VectorXd& by_motor_forces, Gradient& out) const {
    Index first = 0;
    for (const System& system : systems_) {
        const ReducedCoordinates& map = *system.map;
        const Index n = map.coordinates(), m = map.n_motor_coordinates();
        if (m == 0 && !map.has_joint_parameters()) continue;
        const VectorXd z = adjoint_rates(system, lambda, by_motor_forces, first);
        map.joint_parameters_vjp(state_, by_state, z, gradient, out);
        if (m == 0) continue;
        VectorXd by_motors = pull_back_motors(system, map.gather(by_state));
        if (n > 0) by_motors += map.curvature(state_, gradient).bottomLeftCorner(m, n) * z.head(n);
        if (by_motor_forces.size() > 0)
            by_motors += map.motor_force_change(state_, gradient, z.tail(m)).tail(m);
        map.motor_vjp(state_, by_motors, out);
    }
}

VectorXd ReducedAssembly::motor_forces(const VectorXd& gradient) const {
    VectorXd all;
    for (const System& system : systems_) {
        const Index m = system.map->n_motor_coordinates();
        if (m == 0) continue;
        all.conservativeResize(all.size() + m);
        all.tail(m) =
            system.map->motor_units().cwiseProduct(pull_back_motors(system, system.map->gather(gradient)));
    }
    return all;
}

void ReducedAssembly::pull_back(const VectorXd& full, VectorXd& reduced) const {
    if (ties_) ties_->gather(full, reduced);
    for (const System& system : systems_)
        reduced.segment(n_free_ + system.first, system.map->coordinates()) =
            pull_back_free(system, system.map->gather(full));
}

void ReducedAssembly::diagonal(const VectorXd& weights, VectorXd& reduced) const {
    if (ties_) ties_->add_diagonal(weights, reduced);
    for (const System& system : systems_) {
        const Index n = system.map->coordinates();
        if (n == 0) continue;  // an empty matrix has no diagonal to point to
        reduced.segment(n_free_ + system.first, n) =
            system.twists.product(system.map->gather(weights)).diagonal().head(n);
    }
}

void ReducedAssembly::push_forward(const VectorXd& reduced, VectorXd& full) const {
    if (ties_) ties_->extend(full);
    for (const System& system : systems_)
        system.map->scatter(
            system.twists.motion(reduced.segment(n_free_ + system.first, system.map->coordinates())), full);
}

void ReducedAssembly::project(VectorXd& full) const {
    for (const System& system : systems_)
        system.map->scatter(system.twists.motion(free_part(system, full)), full);
}

void ReducedAssembly::replace(const VectorXd& from, VectorXd& to) const {
    for (const System& system : systems_) system.map->scatter(system.map->gather(from), to);
}

void ReducedAssembly::accelerate(const VectorXd& mass, const VectorXd& force, VectorXd& full) const {
    for (const System& system : systems_) {
        const Index n = system.map->coordinates();
        if (n == 0) continue;
        const MatrixXd inertia = system.twists.product(system.map->gather(mass)).topLeftCorner(n, n);
        const VectorXd z = inertia.ldlt().solve(pull_back_free(system, system.map->gather(force)));
        system.map->scatter(system.twists.motion(z), full);
    }
}

void ReducedAssembly::add_curvature_forces(const VectorXd& gradient, const VectorXd& motion,
                                           VectorXd& forces) const {
    for (const System& system : systems_) {
        const Index n = system.map->coordinates();
        if (n == 0) continue;
        const MatrixXd curvature = system.map->curvature(state_, gradient).topLeftCorner(n, n);
        add_nodal_forces(system, curvature * free_part(system, motion), forces);
    }
}

void ReducedAssembly::retract(VectorXd& q, const VectorXd& p) const {
    const VectorXd from = q;
    q += p;
    for (const System& system : systems_) {
        const VectorXd z = coordinates_of(system.map->twists(from), system.map->gather(p));
        system.map->scatter(system.map->gather(from), q);
        system.map->retract(q, z);
    }
}

VectorXd ReducedAssembly::rounding(const VectorXd& q) const {
    VectorXd of_all = VectorXd::Zero(q.size());
    for (const System& system : systems_) {
        const VectorXd of_nodes = system.map->rounding(q);
        for (std::size_t k = 0; k < system.map->nodes().size(); ++k)
            of_all.segment<3>(3 * system.map->nodes()[k]).setConstant(of_nodes[static_cast<Index>(k)]);
    }
    return of_all;
}

void ReducedAssembly::project_state(VectorXd& q, VectorXd* v) const {
    for (const System& system : systems_) system.map->project_state(q, v);
}

void ReducedAssembly::project_state_vjp(const VectorXd& q, const VectorXd& v, VectorXd& by_q, VectorXd& by_v,
                                        Gradient& out, VectorXd* by_rest) const {
    for (const System& system : systems_) system.map->project_state_vjp(q, v, by_q, by_v, out, by_rest);
}

void ReducedAssembly::append_points(const std::vector<Vec3>& full, std::vector<Vec3>& points) const {
    for (const System& system : systems_) {
        Vec3 mean = Vec3::Zero();
        for (const Index node : system.map->nodes())
            mean += full[3 * node] / static_cast<double>(system.map->nodes().size());
        points.insert(points.end(), system.map->coordinates(), mean);
    }
}

std::size_t ReducedAssembly::bytes() const {
    std::size_t total = ties_ ? ties_->bytes() : 0;
    total += (system_of_.capacity() + row_of_.capacity()) * sizeof(Index);
    for (const System& system : systems_) {
        for (const Entries& entries : system.entries) {
            total += entries.mixed.bytes() + entries.inner.bytes();
            for (const auto& [other, across] : entries.across) total += across.bytes();
        }
        const Index n = system.map->coordinates();
        total += system.twists.bytes() + n * n * sizeof(double);
    }
    return total;
}

}  // namespace magshell
