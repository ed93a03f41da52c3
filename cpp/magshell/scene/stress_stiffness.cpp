#include "magshell/scene/stress_stiffness.h"

#include "magshell/core/errors.h"
#include "magshell/terms/stress_rate_term.h"

namespace magshell {
namespace {

// Calls take(stressed, term) for all terms with stresses.
template <class Take>
void each_stressed(const Model& model, const Take& take) {
    for (const std::unique_ptr<Term>& term : model.terms().energies)
        if (auto* const stressed = dynamic_cast<StressRateTerm*>(term.get())) take(*stressed, *term);
}

VectorXd flat(const Strains& strains) {
    VectorXd numbers(strains.elements * strains.width);
    for (Index element = 0; element < strains.elements; ++element)
        for (int i = 0; i < strains.width; ++i)
            numbers[element * strains.width + i] = strains.number(element, i);
    return numbers;
}

}  // namespace

void freeze_stress_rates(Model& model, const VectorXd& q, const LoadParameters& load_parameters,
                         const VectorXd* p) {
    model.evaluate(q, load_parameters);
    each_stressed(
        model, [&](StressRateTerm& term, const Term&) { term.freeze_stress_rates(p ? p->data() : nullptr); });
}

void release_stresses(Model& model) {
    each_stressed(model, [](StressRateTerm& term, const Term&) { term.release_stresses(); });
}

std::vector<VectorXd> strain_rates(Model& model, const VectorXd& q, const LoadParameters& load_parameters,
                                   const VectorXd& p) {
    model.evaluate(q, load_parameters);
    std::vector<VectorXd> rates;
    each_stressed(model, [&](StressRateTerm& term, const Term&) {
        rates.push_back(flat(term.strain_rates(p.data())));
    });
    return rates;
}

void add_stress_work_vjp(Model& model, const VectorXd& q, const LoadParameters& load_parameters,
                         const std::vector<VectorXd>& curvatures, VectorXd& by_q, Gradient& out,
                         VectorXd* by_rest) {
    model.evaluate(q, load_parameters);
    Residual sum;
    sum.reset(model.size());
    std::size_t k = 0;
    each_stressed(model, [&](StressRateTerm& term, const Term&) {
        Strains own = term.strain_rates(q.data());  // of the same shape
        if (k == curvatures.size() || curvatures[k].size() != own.elements * own.width)
            throw InvalidInput("the strain curvatures are not those of the terms of this scene");
        for (Index element = 0; element < own.elements; ++element)
            for (int i = 0; i < own.width; ++i) own.set(element, i, curvatures[k][element * own.width + i]);
        term.add_stress_work_vjp(q.data(), own, sum, out, by_rest);
        ++k;
    });
    by_q += sum.gradient;
}

std::vector<std::string_view> without_stress_work_vjp(const Model& model) {
    std::vector<std::string_view> names;
    each_stressed(model, [&](const StressRateTerm& stressed, const Term& term) {
        if (!stressed.has_stress_work_vjp()) names.push_back(term.name());
    });
    return names;
}

}  // namespace magshell
