// ElementEnergies: terms whose energy is a sum over the elements of their body provide the energy of each.
#pragma once

#include <vector>

#include "magshell/core/parameters.h"

namespace magshell {

class ElementEnergies {
  public:
    virtual ~ElementEnergies() = default;
    /// Returns the energy [J] of every element at q, in the numbering of the caller; their sum is Term::energy().
    virtual std::vector<double> element_energies(const double* q,
                                                 const LoadParameters& load_parameters) const = 0;

  protected:
    /// Returns energy_of_group(group) of the elements of a loop. user: the caller's number of each.
    template <class Loop, class Shares>
    static std::vector<double> of_elements(const Loop& loop, const std::vector<Index>& user,
                                           const Shares& energy_of_group) {
        std::vector<double> energies(user.size());
        loop.each_group([&](Index group) {
            const SimdDouble of_group = energy_of_group(group);
            for (int lane = 0; lane < loop.lanes_in(group); ++lane)
                energies[user[loop.element(group, lane)]] = of_group[lane];
        });
        return energies;
    }
};

}  // namespace magshell
