// Dead loads: forces that keep size and direction. Gravity is one, point, edge and area loads are others.
//
//   E = - factor f . x                                                              [J]
#pragma once

#include "magshell/assembly/lanes.h"

namespace magshell {

class LoadTerm final : public Term {
  public:
    /// forces [N], three a node; `factor` is the control that scales them.
    LoadTerm(std::string_view name, VectorXd forces, double Controls::*factor)
        : name_(name), forces_(std::move(forces)), factor_(factor) {}

    void set_forces(VectorXd forces) { forces_ = std::move(forces); }

    std::string_view name() const override { return name_; }

    double energy(const double* q, const Controls& controls) const override {
        return -(controls.*factor_) * forces_.dot(Eigen::Map<const VectorXd>(q, forces_.size()));
    }

    void evaluate(const double*, const Controls& controls, Residual& out) override {
        for (Index k = 0; k < forces_.size(); ++k) out.add(k, -(controls.*factor_) * forces_[k]);
    }

    std::size_t bytes() const override { return forces_.size() * sizeof(double); }

  private:
    std::string_view name_;
    VectorXd forces_;
    double Controls::*factor_;
};

}  // namespace magshell
