// Elastic energies of some strains an element, 1/2 d^T C d of a sheet's three: what they share, written once.
#pragma once

#include "magshell/term/strains.h"
#include "magshell/term/term.h"

namespace magshell {

class ElasticTerm : public Term {
  public:
    bool driven() const override { return false; }
    bool add_projective_stiffness(NodeMatrix&) const override { return false; }

    /// From now on; an empty history makes the term elastic again.
    void set_history(const StrainHistory& history) { history_ = history; }

    /// How many there are, each with so many strains.
    virtual Index elements() const = 0;
    virtual int strains_per_element() const { return 3; }
    /// d at q.
    virtual Strains strains(const double* q) = 0;
    /// J p at the last evaluated state.
    virtual Strains strain_rates(const double* p) = 0;
    /// C d, without history; of a solid, with its stiffness at rest.
    virtual Strains stresses(const Strains& strains) const = 0;
    /// Adds J^T s at the last evaluated state.
    virtual void add_forces(const Strains& stresses, Residual& out) = 0;
    /// Adds s . dd/dk at the last evaluated state for every value k from which the strains are measured.
    virtual void strains_vjp(const Strains& /*stresses*/, Gradient& /*out*/) const {}

    /// An edge rotation counts from the mean of the faces on both sides, which it couples by that. To first order it may count
    /// from where the edge was: then a face's energy is of its own nodes and rotations alone, and the Hessian has fewer
    /// entries. From now on, or no longer, the Hessian is that: of the rest shape, evaluated last, without stress.
    virtual void count_rotations_from_rest(bool /*from_rest*/) {}
    /// While it is: of a small motion of all unknowns, its rotations as they count otherwise; and forces on such ones as those
    /// on what counts from rest.
    virtual void rotations_from_sides(VectorXd& /*motion*/) const {}
    virtual void forces_from_rest(VectorXd& /*forces*/) const {}

  protected:
    StrainHistory history_;
};

/// The scaffold. A Kernel (the deriving class) has
///     each_pack(body)                   body(pack) for all packs of its elements
///     begin_strains(q), begin_rates(p)  what the strains of all elements need beforehand
///     strain(pack, q, d), rate(pack, p, d)   d at q; J p at the last evaluated state
///     stiffness(pack)                   C
/// of N strains an element.
template <class Kernel, int N = 3>
class StrainScaffold : public ElasticTerm {
  public:
    explicit StrainScaffold(Index elements) : stress_(elements, N), extrapolated_(elements, N) {}

    Index elements() const final { return stress_.elements; }
    int strains_per_element() const final { return N; }

    void extrapolate(const double* p) final {
        kernel().begin_rates(p);
        kernel().each_pack([&](Index pack) {
            Pack along[N], change[N];
            kernel().rate(pack, p, along);
            history_.scaled(kernel().stiffness(pack)).times(along, change);
            for (int i = 0; i < N; ++i) extrapolated_.at(pack)[i] = stress_.at(pack)[i] + change[i];
        });
    }

    Strains strains(const double* q) final {
        kernel().begin_strains(q);
        Strains out(stress_.elements, N);
        kernel().each_pack([&](Index pack) { kernel().strain(pack, q, out.at(pack)); });
        return out;
    }

    Strains strain_rates(const double* p) final {
        kernel().begin_rates(p);
        Strains out(stress_.elements, N);
        kernel().each_pack([&](Index pack) { kernel().rate(pack, p, out.at(pack)); });
        return out;
    }

    Strains stresses(const Strains& strains) const final {
        Strains out(stress_.elements, N);
        kernel().each_pack(
            [&](Index pack) { kernel().stiffness(pack).times(strains.at(pack), out.at(pack)); });
        return out;
    }

  protected:
    /// Keeps the stress of a pack, given its strain.
    void keep_stress(Index pack, Pack strain[N]) {
        history_.apply<N>(pack, strain);
        kernel().stiffness(pack).times(strain, stress_.at(pack));
    }

    std::size_t bytes_of_stresses() const { return bytes_of(stress_.packs) + bytes_of(extrapolated_.packs); }

    Strains stress_, extrapolated_;

  private:
    Kernel& kernel() { return static_cast<Kernel&>(*this); }
    const Kernel& kernel() const { return static_cast<const Kernel&>(*this); }
};

}  // namespace magshell
