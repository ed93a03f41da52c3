// ElasticTerm: terms with an energy 1/2 d^T C d of strains d per element, and the part of their code that they
// share.
//
// Terms of this kind can be made viscous by a strain history (strains.h) and take part in the mixed Newton
// method, which extrapolates their stresses.
#pragma once

#include "magshell/terms/rest_shape_term.h"
#include "magshell/terms/shell/strains.h"
#include "magshell/terms/stress_rate_term.h"
#include "magshell/terms/term.h"

namespace magshell {

class ElasticTerm : public Term {
  public:
    bool depends_on_loads() const override { return false; }
    bool add_projective_stiffness(NodeMatrix&) const override { return false; }

    /// Sets the strain history that the stresses follow from now on. An empty history makes the term elastic
    /// again.
    void set_history(const StrainHistory& history) { history_ = history; }

    /// Returns the number of elements.
    virtual Index elements() const = 0;
    virtual int strains_per_element() const { return 3; }
    /// Returns the strains d at q.
    virtual Strains strains(const double* q) = 0;
    /// Returns the strain rates J p at the last evaluated state.
    virtual Strains strain_rates(const double* p) = 0;
    /// Returns the stresses C d without history. A solid uses its stiffness in the reference configuration.
    virtual Strains stresses(const Strains& strains) const = 0;
    /// Adds the forces J^T s of the stresses s at the last evaluated state.
    virtual void add_forces(const Strains& stresses, Residual& out) = 0;
    /// Adds s . dd/dk at the last evaluated state for every parameter k on which the reference strains depend,
    /// such as growth.
    virtual void strains_vjp(const Strains& /*stresses*/, Gradient& /*out*/) const {}

    /// Switches to edge rotations that are measured from the reference orientation of the edge instead of from
    /// the mean normal of the two adjacent faces. To first order both are equivalent, but measured from the
    /// reference the energy of a face depends on its own nodes and rotations only, so that the Hessian has
    /// fewer nonzeros. While it is on, the Hessian must be that of the unstressed reference shape, and that
    /// shape must be the last evaluated state.
    virtual void count_rotations_from_rest(bool /*from_rest*/) {}
    /// Converts a small motion of all degrees of freedom, and forces on them, between the two ways of measuring
    /// edge rotations: rotations_from_sides() makes the rotations of a motion relative to the mean normal
    /// again; forces_from_rest() turns forces on relative rotations into forces on absolute ones.
    virtual void rotations_from_sides(VectorXd& /*motion*/) const {}
    virtual void forces_from_rest(VectorXd& /*forces*/) const {}

  protected:
    StrainHistory history_;
};

/// ElasticTerm for a class `Kernel` that derives from it and provides, for N strains per element,
///       each_group(body)                         calls body(group) for all SIMD vectors of its elements
///       begin_strains(q), begin_rates(p)       computes what the strains of all elements share
///       strain(group, q, d), rate(group, p, d)   the strains d at q; J p at the last evaluated state
///       stiffness(group)                        C
template <class Kernel, int N = 3>
class StrainScaffold : public ElasticTerm, public StressRateTerm {
  public:
    explicit StrainScaffold(Index elements) : stress_(elements, N), extrapolated_(elements, N) {}

    Index elements() const final { return stress_.elements; }
    int strains_per_element() const final { return N; }

    void extrapolate(const double* p) final {
        kernel().begin_rates(p);
        kernel().each_group([&](Index group) {
            SimdDouble along[N], change[N];
            kernel().rate(group, p, along);
            history_.scaled(kernel().stiffness(group)).times(along, change);
            for (int i = 0; i < N; ++i) extrapolated_.at(group)[i] = stress_.at(group)[i] + change[i];
        });
    }

    Strains strains(const double* q) final {
        kernel().begin_strains(q);
        Strains out(stress_.elements, N);
        kernel().each_group([&](Index group) { kernel().strain(group, q, out.at(group)); });
        return out;
    }

    Strains strain_rates(const double* p) final {
        kernel().begin_rates(p);
        Strains out(stress_.elements, N);
        kernel().each_group([&](Index group) { kernel().rate(group, p, out.at(group)); });
        return out;
    }

    Strains stresses(const Strains& strains) const final {
        Strains out(stress_.elements, N);
        kernel().each_group(
            [&](Index group) { kernel().stiffness(group).times(strains.at(group), out.at(group)); });
        return out;
    }

    /// Holds the rates as a strain history: C (0 d + J p) is their stress.
    void freeze_stress_rates(const double* p) final {
        frozen_ = Strains(stress_.elements, N);
        if (p) {
            frozen_ = strain_rates(p);
            for (SimdDouble& entry : frozen_.groups) entry = -entry;
        }
        history_ = {0.0, &frozen_};
    }
    void release_stresses() final { history_ = {}; }
    bool has_stress_work_vjp() const final { return true; }
    void add_stress_work_vjp(const double*, const Strains& curvatures, Residual& by_q, Gradient& out,
                             VectorXd* by_rest) final {
        const Strains weights = stresses(curvatures);
        add_forces(weights, by_q);
        strains_vjp(weights, out);
        if (by_rest) static_cast<const RestShapeTerm&>(kernel()).add_rest_strains_vjp(weights, *by_rest);
    }

  protected:
    /// Computes and stores the stress of a SIMD vector from its strain.
    void store_stress(Index group, SimdDouble strain[N]) {
        history_.apply<N>(group, strain);
        kernel().stiffness(group).times(strain, stress_.at(group));
    }

    std::size_t bytes_of_stresses() const {
        return bytes_of(stress_.groups) + bytes_of(extrapolated_.groups);
    }

    Strains stress_, extrapolated_;

  private:
    Strains frozen_;  // -J p, while stresses are held at their rates

    Kernel& kernel() { return static_cast<Kernel&>(*this); }
    const Kernel& kernel() const { return static_cast<const Kernel&>(*this); }
};

}  // namespace magshell
