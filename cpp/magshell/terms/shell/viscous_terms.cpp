#include "magshell/terms/shell/viscous_terms.h"

#include <utility>

namespace magshell {

void ViscousTerms::set_history(double scale, const StrainSet* shift) {
    scale_ = scale;
    for (std::size_t k = 0; k < terms_.size(); ++k)
        terms_[k]->set_history({scale, shift ? &shift->of_terms[k] : nullptr});
}

StrainSet ViscousTerms::strains(const VectorXd& q) const {
    StrainSet strains;
    for (ElasticTerm* term : terms_) strains.of_terms.push_back(term->strains(q.data()));
    return strains;
}

StrainSet ViscousTerms::rates(const VectorXd& p) const {
    StrainSet rates;
    for (ElasticTerm* term : terms_) rates.of_terms.push_back(term->strain_rates(p.data()));
    return rates;
}

VectorXd ViscousTerms::forces(const StrainSet& stresses, Index unknowns) const {
    Residual forces;
    forces.reset(unknowns);
    for (std::size_t k = 0; k < terms_.size(); ++k) terms_[k]->add_forces(stresses.of_terms[k], forces);
    return std::move(forces.gradient);
}

void ViscousTerms::strains_vjp(const StrainSet& stresses, Gradient& out) const {
    for (std::size_t k = 0; k < terms_.size(); ++k) terms_[k]->strains_vjp(stresses.of_terms[k], out);
}

StrainSet ViscousTerms::stresses(const StrainSet& strains) const {
    StrainSet stresses;
    for (std::size_t k = 0; k < terms_.size(); ++k)
        stresses.of_terms.push_back(terms_[k]->stresses(strains.of_terms[k]));
    return stresses;
}

StrainSet ViscousTerms::zeros() const {
    StrainSet strains;
    for (const ElasticTerm* term : terms_)
        strains.of_terms.emplace_back(term->elements(), term->strains_per_element());
    return strains;
}

Index ViscousTerms::size() const {
    Index count = 0;
    for (const ElasticTerm* term : terms_) count += term->strains_per_element() * term->elements();
    return count;
}

}  // namespace magshell
