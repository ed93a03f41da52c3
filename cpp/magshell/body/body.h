// What the assembly asks of a body: which unknowns its elements couple, and which folds come with them.
#pragma once

#include <span>

#include "magshell/core/types.h"

namespace magshell {

class Body {
  public:
    virtual ~Body() = default;

    virtual Index n_elements() const = 0;
    /// Nodes that an element couples; negative: none there.
    virtual std::span<const Index> nodes_of(Index element) const = 0;
    /// Scalars likewise.
    virtual std::span<const Index> scalars_of(Index /*element*/) const { return {}; }

    virtual Index n_folds() const { return 0; }
    /// The first of the elements that a fold belongs to; ascending.
    virtual Index element_of_fold(Index /*fold*/) const { return 0; }
};

}  // namespace magshell
