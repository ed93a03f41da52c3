#include "magshell/terms/load/group_energy_term.h"

#include <cmath>

#include "magshell/assembly/lanes.h"
#include "magshell/core/errors.h"
#include "magshell/linalg/dense_decompositions.h"

namespace magshell {

GroupEnergyTerm::GroupEnergyTerm(const GroupEnergyInput& input, const Nodes& nodes,
                                 const SystemMatrix& matrix, Registry& registry)
    : all_nodes_(nodes),
      name_(input.name),
      group_size_(input.group_size),
      is_load_(input.is_load),
      energy_(input.energy),
      factor_(registry.load_parameters.add("scene", "load_factor", "1", 1, 1)) {
    for (const Index vertex : input.vertices) nodes_.push_back(nodes.vertices.core[vertex]);
    for (Index group = 0; group < groups(); ++group) {
        const Index* own = nodes_.data() + group * group_size_;
        for (Index i = 1; i < group_size_; ++i)
            for (Index j = 0; j < i; ++j)
                slots_.push_back(own[i] == own[j] ? same_node : matrix.node_slot(own[i], own[j]));
    }
    Index size = 0;
    for (const GroupEnergyInput::Value& value : input.values) {
        slices_.push_back(registry.values.add(input.owner, value.name, "SI", value.rows, value.width));
        size += slices_.back().size();
    }
    values_ = VectorXd::Zero(size);
}

VectorXd GroupEnergyTerm::gather(const double* q) const {
    VectorXd x(3 * nodes_.size());
    for (std::size_t k = 0; k < nodes_.size(); ++k)
        x.segment<3>(3 * k) = Eigen::Map<const Vec3>(q + 3 * nodes_[k]);
    return x;
}

std::string GroupEnergyTerm::describe(Index group) const {
    constexpr Index most_named = 6;
    std::string text = "group " + std::to_string(group) + " (vertices";
    for (Index k = 0; k < std::min(group_size_, most_named); ++k)
        text += (k ? ", " : " ") + std::to_string(all_nodes_.user_vertex(nodes_[group * group_size_ + k]));
    return text + (group_size_ > most_named ? ", ...)" : ")");
}

bool GroupEnergyTerm::set_values(const Values& values) {
    Index first = 0;
    bool changed = false;
    for (const ParameterSlice& slice : slices_) {
        values_.segment(first, slice.size()) = Eigen::Map<const VectorXd>(values[slice], slice.size());
        first += slice.size();
        changed |= values.changed(slice);
    }
    return changed;
}

std::string GroupEnergyTerm::invalid_state_reason(const double* q) const {
    const GroupSamples found = energy_->sample(gather(q), values_, 1);
    for (Index group = 0; group < groups(); ++group) {
        const bool has_energy = std::isfinite(found.energies[group]);
        if (has_energy && found.gradients.segment(group * width(), width()).allFinite()) continue;
        return "the " + std::string(has_energy ? "gradient of the " : "") + "energy '" + name_ +
               "' is not finite in " + describe(group);
    }
    return {};
}

double GroupEnergyTerm::energy(const double* q, const LoadParameters& load_parameters) const {
    const double scale = factor(load_parameters);
    return scale == 0.0 ? 0.0 : scale * energy_->sample(gather(q), values_, 0).energies.sum();
}

void GroupEnergyTerm::evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) {
    const double scale = factor(load_parameters);
    if (scale == 0.0) return;
    const VectorXd gradients = energy_->sample(gather(q), values_, 1).gradients;
    for (std::size_t k = 0; k < nodes_.size(); ++k)
        for (int axis = 0; axis < 3; ++axis) out.add(3 * nodes_[k] + axis, scale * gradients[3 * k + axis]);
}

void GroupEnergyTerm::finish_assembly(const double* q, const LoadParameters& load_parameters,
                                      SystemMatrix& out) const {
    const double scale = factor(load_parameters);
    if (scale == 0.0) return;
    const VectorXd hessians = energy_->sample(gather(q), values_, 2).hessians;
    for (Index group = 0; group < groups(); ++group) {
        Eigen::MatrixXd hessian = scale * Eigen::Map<const Eigen::MatrixXd>(
                                              hessians.data() + group * width() * width(), width(), width());
        if (!hessian.allFinite())
            throw InvalidInput("the second derivatives of the energy '" + name_ + "' are not finite in " +
                               describe(group) + ", where it is not smooth: write it so that it is");
        if (psd_projection_) {
            const SymmetricEigen eigen = eigen_of_symmetric(hessian);
            hessian = eigen.vectors * eigen.values.cwiseMax(0.0).asDiagonal() * eigen.vectors.transpose();
        }
        scatter(group, hessian, out);
    }
}

void GroupEnergyTerm::scatter(Index group, const Eigen::MatrixXd& hessian, SystemMatrix& out) const {
    const Index* own = nodes_.data() + group * group_size_;
    const SystemMatrix::Slot* slots = slots_.data() + group * (group_size_ * (group_size_ - 1) / 2);
    for (Index i = 0; i < group_size_; ++i) {
        out.add_diagonal_block(own[i], Mat3(hessian.block<3, 3>(3 * i, 3 * i)));
        for (Index j = 0; j < i; ++j) {
            const Mat3 block = hessian.block<3, 3>(3 * i, 3 * j);
            const SystemMatrix::Slot slot = slots[lower_index(static_cast<int>(i) - 1, static_cast<int>(j))];
            if (slot == same_node)
                out.add_diagonal_block(own[i], Mat3(block + block.transpose()));
            else
                out.add_block(slot, out.column_length(own[slot & 1 ? i : j]), block);
        }
    }
}

// Rounding of the positions changes the forces by the stiffness times the coordinates. Entries that are not finite, where the
// energy is not smooth at rest, say nothing.
void GroupEnergyTerm::add_cancelling_forces(double beyond, VectorXd& out) const {
    VectorXd rest(3 * nodes_.size());
    for (std::size_t k = 0; k < nodes_.size(); ++k) rest.segment<3>(3 * k) = all_nodes_.rest[nodes_[k]];
    const VectorXd hessians = energy_->sample(rest, values_, 2).hessians;
    for (Index group = 0; group < groups(); ++group) {
        const double coordinate = rest.segment(group * width(), width()).lpNorm<Eigen::Infinity>() + beyond;
        const double* row = hessians.data() + group * width() * width();
        for (Index k = 0; k < width(); ++k, row += width()) {
            const double stiffness = Eigen::Map<const VectorXd>(row, width()).lpNorm<1>();
            if (std::isfinite(stiffness))
                out[3 * nodes_[group * group_size_ + k / 3] + k % 3] += stiffness * coordinate;
        }
    }
}

void GroupEnergyTerm::vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
                          Gradient& out) {
    const VectorXd x = gather(q), rates = gather(lambda);
    if (is_load_) out.load_parameters[factor_.first] += energy_->sample(x, values_, 1).gradients.dot(rates);
    const double scale = factor(load_parameters);
    if (scale == 0.0 || slices_.empty()) return;
    const VectorXd by_values = energy_->rate_by_values(x, values_, rates);
    Index first = 0;
    for (const ParameterSlice& slice : slices_) {
        out.values.segment(slice.first, slice.size()) += scale * by_values.segment(first, slice.size());
        first += slice.size();
    }
}

std::size_t GroupEnergyTerm::bytes() const {
    return bytes_of(nodes_) + bytes_of(slots_) + bytes_of(slices_) + values_.size() * sizeof(double);
}

}  // namespace magshell
