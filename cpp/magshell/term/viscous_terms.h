// The terms whose stress may know where their strain has been, as one: what a law of viscosity asks of a scene.
#pragma once

#include <vector>

#include "magshell/term/elastic_term.h"

namespace magshell {

class ViscousTerms {
  public:
    void add(ElasticTerm* term) { terms_.push_back(term); }
    const std::vector<ElasticTerm*>& all() const { return terms_; }
    bool empty() const { return terms_.empty(); }

    /// Their stresses are C (scale d - shift) from now on, and C d without a shift.
    void set_history(double scale, const StrainSet* shift);
    double scale() const { return scale_; }

    StrainSet strains(const VectorXd& q) const;
    /// At the last evaluated state: J p, and J^T s.
    StrainSet rates(const VectorXd& p) const;
    VectorXd forces(const StrainSet& stresses, Index unknowns) const;
    void strains_vjp(const StrainSet& stresses, Gradient& out) const;
    StrainSet stresses(const StrainSet& strains) const;
    /// Zeros; and how many numbers they are.
    StrainSet zeros() const;
    Index size() const;

  private:
    std::vector<ElasticTerm*> terms_;
    double scale_ = 1.0;
};

}  // namespace magshell
