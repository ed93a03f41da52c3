// LoadTerm: dead loads, forces that keep their magnitude and direction: gravity, and point, edge and area
// loads.
#pragma once

#include <string>

#include "magshell/body/nodes.h"
#include "magshell/terms/term.h"

namespace magshell {

class LoadTerm final : public Term {
  public:
    /// Registers the forces, three components per vertex, under the term's name, and the load parameter that
    /// scales them.
    LoadTerm(const std::string& name, const std::string& factor, const Nodes& nodes, Registry& registry)
        : name_(name),
          slice_(registry.values.add(name, "forces", "N", nodes.n_user_vertices(), 3, &nodes.vertices)),
          factor_(registry.load_parameters.add("scene", factor, "1", 1, 1)),
          forces_(VectorXd::Zero(nodes.n_coordinates())) {}

    std::string_view name() const override { return name_; }

    bool set_values(const Values& values) override {
        forces_ = Eigen::Map<const VectorXd>(values[slice_], forces_.size());
        return values.changed(slice_);
    }

    double energy(const double* q, const LoadParameters& load_parameters) const override {
        return -load_parameters[factor_.first] * forces_.dot(Eigen::Map<const VectorXd>(q, forces_.size()));
    }

    void evaluate(const double*, const LoadParameters& load_parameters, Residual& out) override {
        const double factor = load_parameters[factor_.first];
        for (Index k = 0; k < forces_.size(); ++k) out.add(k, -factor * forces_[k]);
    }

    void vjp(const double*, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override {
        const Eigen::Map<const VectorXd> at_vertices(lambda, forces_.size());
        out.values.segment(slice_.first, forces_.size()) -= load_parameters[factor_.first] * at_vertices;
        out.load_parameters[factor_.first] -= forces_.dot(at_vertices);
    }

    std::size_t bytes() const override { return forces_.size() * sizeof(double); }

  private:
    std::string name_;
    ParameterSlice slice_, factor_;
    VectorXd forces_;
};

}  // namespace magshell
