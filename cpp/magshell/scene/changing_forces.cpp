#include "magshell/scene/changing_forces.h"

#include <utility>

namespace magshell {

ChangingForces::ChangingForces(Model& model, const VectorXd& here, const VectorXd& there) {
    const Parameters& parameters = model.parameters().registry().values;
    Values values;
    for (const bool is_there : {false, true, false}) {  // the terms keep the parameters that the model has
        values.set(parameters, parameters.to_core(is_there ? there : here));
        for (const std::unique_ptr<Term>& term : model.terms().energies)
            if ((term->set_values(values) || term->varies()) && is_there) terms_.push_back(term.get());
    }
}

VectorXd ChangingForces::at(const VectorXd& q, const LoadParameters& load_parameters) const {
    Residual sum;
    sum.reset(q.size());
    for (Term* term : terms_) term->evaluate(q.data(), load_parameters, sum);
    return std::move(sum.gradient);
}

}  // namespace magshell
