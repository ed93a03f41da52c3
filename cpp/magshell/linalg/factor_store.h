// Factorizations to be had again: what two patterns need that are used by turns is analysed once.
#pragma once

#include <array>
#include <functional>
#include <memory>

#include "magshell/linalg/factor.h"

namespace magshell {

class FactorStore {
  public:
    using Analyze = std::function<std::unique_ptr<Factor>()>;

    /// One for a pattern, which is the same if it is the same object; analysed by the function where it is none of the two
    /// asked for last.
    std::shared_ptr<Factor> get(const std::shared_ptr<const SparsePattern>& pattern, const Analyze& analyze);
    /// One that nobody else holds, for the next who asks: fresh memory costs page faults. What is large goes back to the
    /// system.
    void store(std::shared_ptr<Factor> factor);
    /// How often a pattern was analysed.
    int analyses() const { return analyses_; }

  private:
    struct Shelf {
        std::unique_ptr<Factor> analysed;
        std::shared_ptr<Factor> spare;
    };

    Shelf* shelf_of(const std::shared_ptr<const SparsePattern>& pattern);

    std::array<Shelf, 2> shelves_;  // the one asked for last first
    int analyses_ = 0;
};

}  // namespace magshell
