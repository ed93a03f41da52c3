// The forces of the terms of a scene, one by one: those of the energy, then those without an energy.
#pragma once

#include "magshell/scene/model.h"

namespace magshell {

class TermForces {
  public:
    /// The model must outlive it.
    explicit TermForces(Model& model)
        : model_(model),
          energies_(static_cast<Index>(model.terms().energies.size())),
          rows_(energies_ + static_cast<Index>(model.terms().forces.size())) {}

    /// Returns the number of terms of the energy, and of all terms.
    Index energies() const { return energies_; }
    Index rows() const { return rows_; }
    /// Returns true if a term is part of what Contacts evaluates.
    bool is_contact(Index row) const {
        const std::string_view name = row < energies_ ? model_.terms().energies[row]->name()
                                                      : model_.terms().forces[row - energies_]->name();
        return name == "contact" || name == "body contact" || name == "friction" || name == "body friction";
    }

    /// Returns the first force that may carry momentum, for what all of them carry; -1 without one.
    Index fluid_term() const {
        for (Index k = energies_; k < rows_; ++k)
            if (model_.terms().forces[k - energies_]->may_have_fluid_momentum()) return k;
        return -1;
    }

    /// Returns 1 for each node of a rigid part, 0 for the others.
    std::vector<char> nodes_of_rigid_parts() const {
        std::vector<char> found(model_.nodes().n_nodes(), 0);
        for (const std::vector<Index>& part : model_.bodies().rigid_nodes())
            for (const Index node : part) found[node] = 1;
        return found;
    }

    /// Calls add(row, gradient) with minus the force of each term [N] in a stage that ends at q. The model is linearized at q, and has the
    /// values and angle branches of that state.
    template <class Add>
    void each(const VectorXd& q, const LoadParameters& load_parameters, const StageMotion& stage,
              const Add& add) const {
        Residual out;
        for (Index k = 0; k < energies_; ++k) {
            out.reset(model_.size());
            model_.terms().energies[k]->evaluate(q.data(), load_parameters, out);
            add(k, out.gradient);
        }
        if (rows_ == energies_) return;
        model_.evaluate_forces(q, load_parameters, stage);  // sets the kinematics
        for (Index k = energies_; k < rows_; ++k) {
            out.reset(model_.size());
            model_.terms().forces[k - energies_]->evaluate(model_.kinematics(), load_parameters, out);
            add(k, out.gradient);
        }
    }

    /// Returns the energies [J] of the terms for which wanted(row) is true; zero for others.
    template <class Wanted>
    VectorXd energies_at(const VectorXd& q, const LoadParameters& load_parameters,
                         const Wanted& wanted) const {
        VectorXd found = VectorXd::Zero(energies_);
        for (Index k = 0; k < energies_; ++k)
            if (wanted(k)) found[k] = model_.terms().energies[k]->energy(q.data(), load_parameters);
        return found;
    }

  private:
    Model& model_;
    Index energies_, rows_;
};

}  // namespace magshell
