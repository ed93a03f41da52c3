// The muscle fibres in some elements of a solid, with blocks of their own: their contributions are added to those of the solid.
#pragma once

#include <array>
#include <vector>

#include "magshell/body/solid.h"

namespace magshell {

class Fibres final : public Body {
  public:
    /// elements: of the solid, in the numbering of the caller, each once. The solid must outlive this object.
    Fibres(const Solid& solid, const std::vector<Index>& elements);
    Fibres(const Fibres&) = delete;
    Fibres& operator=(const Fibres&) = delete;

    Index n_elements() const override { return static_cast<Index>(of_solid.size()); }
    std::span<const Index> nodes_of(Index element) const override {
        return solid.nodes_of(of_solid[element]);
    }
    Vec3 rest(Index element, int k) const { return solid.rest(of_solid[element], k); }

    const Solid& solid;
    Renumbering elements;                            // the caller's list of elements <-> ours
    std::vector<Index> of_solid;                     // per fibre element: its number in the solid, ascending
    std::vector<std::array<Index, 4>> linear_nodes;  // as those of the solid
    std::vector<std::array<Index, 10>> quadratic_nodes;
};

}  // namespace magshell
