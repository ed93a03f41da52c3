// The strains of all elastic terms at a state, and what makes an elastic term viscous: a stress that knows
// where the strain has been.
//
//   sigma = C (scale d - shift)
//
// covers every linear law that is integrated implicitly in time; solve/viscosity.h has those that are used.
#pragma once

#include <vector>

#include "magshell/assembly/lanes.h"

namespace magshell {

/// `width` numbers an element, three of a sheet's, in the layout of packs: strain i of pack p at width p + i, one
/// lane an element.
struct Strains {
    LargeVector<Pack> packs;
    Index elements = 0;
    int width = 3;

    explicit Strains(Index elements_ = 0, int width_ = 3)
        : packs(static_cast<std::size_t>(width_) * packs_for(elements_), Pack(0.0)),
          elements(elements_),
          width(width_) {}
    Pack* at(Index pack) { return packs.data() + static_cast<std::size_t>(width) * pack; }
    const Pack* at(Index pack) const { return packs.data() + static_cast<std::size_t>(width) * pack; }
    double number(Index element, int i) const { return at(element / Pack::width)[i][element % Pack::width]; }
    void set(Index element, int i, double value) {
        at(element / Pack::width)[i].set(element % Pack::width, value);
    }
};

/// Of all elastic terms of a scene, one after another; a vector space.
struct StrainSet {
    std::vector<Strains> of_terms;

    bool empty() const { return of_terms.empty(); }
    void add(double factor, const StrainSet& other);
    StrainSet times(double factor) const;
    /// The sum over the elements.
    double dot(const StrainSet& other) const;
    std::size_t bytes() const;
};

struct StrainHistory {
    double scale = 1.0;
    const Strains* shift = nullptr;

    /// From d to scale d - shift.
    template <int N = 3>
    void apply(Index pack, Pack strain[N]) const {
        if (!shift) return;
        for (int i = 0; i < N; ++i) strain[i] = Pack(scale) * strain[i] - shift->at(pack)[i];
    }

    /// How much of today's strain the stress has.
    double factor() const { return shift ? scale : 1.0; }

    /// scale C.
    template <int N>
    Symmetric<N> scaled(const Symmetric<N>& stiffness) const {
        Symmetric<N> result = stiffness;
        if (shift)
            for (Pack& entry : result.at) entry *= Pack(scale);
        return result;
    }
};

}  // namespace magshell
