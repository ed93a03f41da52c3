// ViscousTerms: all terms whose stress can have a strain history, treated as one. This is the interface between
// viscosity laws (solve/motion/viscosity.h) and a scene.
#pragma once

#include <vector>

#include "magshell/terms/shell/elastic_term.h"

namespace magshell {

class ViscousTerms {
  public:
    void add(ElasticTerm* term) { terms_.push_back(term); }
    const std::vector<ElasticTerm*>& all() const { return terms_; }
    bool empty() const { return terms_.empty(); }

    /// Sets the history of all terms: their stresses are C (scale d - shift) from now on, or C d without a
    /// shift.
    void set_history(double scale, const StrainSet* shift);
    double scale() const { return scale_; }

    StrainSet strains(const VectorXd& q) const;
    /// Return J p and J^T s at the last evaluated state.
    StrainSet rates(const VectorXd& p) const;
    VectorXd forces(const StrainSet& stresses, Index unknowns) const;
    void strains_vjp(const StrainSet& stresses, Gradient& out) const;
    StrainSet stresses(const StrainSet& strains) const;
    /// zeros() returns strains that are all zero; size() their number.
    StrainSet zeros() const;
    Index size() const;

  private:
    std::vector<ElasticTerm*> terms_;
    double scale_ = 1.0;
};

}  // namespace magshell
