// OperatorPart: the part of a Hessian at one state that is known by its products only, as Python objects hand it to factorizations.
#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "bindings/bindings.h"
#include "magshell/linalg/krylov/operator_factor.h"
#include "magshell/scene/model.h"

namespace magshell::bindings {

class OperatorPart {
  public:
    /// Takes the product of the Hessian that `owner`, a Model, assembled last, at the state q. It keeps the model alive.
    OperatorPart(const py::object& owner, VectorXd q, OperatorFactor::Operator product)
        : owner_(new py::object(owner),
                 [](py::object* each) {
                     const py::gil_scoped_acquire locked;
                     delete each;
                 }),
          model_(owner.cast<Model*>()),
          q_(std::move(q)),
          product_(std::move(product), size()) {}

    Index size() const { return model_->dof_map().size(); }

    /// Returns the product with a vector of the free dofs. The model stays linearized at the state.
    VectorXd product(const VectorXd& x) const {
        const std::lock_guard lock(model_->in_use());
        model_->linearize(q_);
        return product_(x);
    }

  private:
    std::shared_ptr<py::object> owner_;
    Model* model_;
    VectorXd q_;
    RepeatedOperator product_;
};

using WeightedOperators = std::vector<std::pair<double, std::shared_ptr<OperatorPart>>>;

/// Returns the product with the sum of weights times operators.
inline OperatorFactor::Operator sum_of(WeightedOperators operators) {
    return [operators = std::move(operators)](const VectorXd& x) {
        VectorXd sum = VectorXd::Zero(x.size());
        for (const auto& [weight, each] : operators) sum += weight * each->product(x);
        return sum;
    };
}

}  // namespace magshell::bindings
