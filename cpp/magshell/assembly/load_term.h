// Dead loads: forces that keep size and direction. Gravity is one, point, edge and area loads are others.
//
//   E = - factor f . x                                                              [J]
#pragma once

#include "magshell/assembly/lanes.h"

namespace magshell {

class LoadTerm final : public Term {
  public:
    /// forces [N], three a node; `factor` is the control that scales them, `by_forces` where their gradient goes.
    LoadTerm(std::string_view name, VectorXd forces, double Controls::*factor, VectorXd SceneGradient::*by_forces)
        : name_(name), forces_(std::move(forces)), factor_(factor), by_forces_(by_forces) {}

    void set_forces(VectorXd forces) { forces_ = std::move(forces); }

    std::string_view name() const override { return name_; }

    double energy(const double* q, const Controls& controls) const override {
        return -(controls.*factor_) * forces_.dot(Eigen::Map<const VectorXd>(q, forces_.size()));
    }

    void evaluate(const double*, const Controls& controls, Residual& out) override {
        for (Index k = 0; k < forces_.size(); ++k) out.add(k, -(controls.*factor_) * forces_[k]);
    }

    void vjp(const double*, const Controls& controls, const double* lambda, SceneGradient& out) override {
        const Eigen::Map<const VectorXd> at_nodes(lambda, forces_.size());
        out.*by_forces_ = -(controls.*factor_) * at_nodes;
        out.controls.*factor_ -= forces_.dot(at_nodes);
    }

    std::size_t bytes() const override { return forces_.size() * sizeof(double); }

  private:
    std::string_view name_;
    VectorXd forces_;
    double Controls::*factor_;
    VectorXd SceneGradient::*by_forces_;
};

}  // namespace magshell
