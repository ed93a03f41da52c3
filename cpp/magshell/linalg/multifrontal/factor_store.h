// FactorStore: keeps the analyses of the last two patterns, so that patterns used in turn are analysed once.
#pragma once

#include <array>
#include <functional>
#include <memory>

#include "magshell/linalg/factor.h"

namespace magshell {

class FactorStore {
  public:
    using Analyze = std::function<std::unique_ptr<Factor>()>;

    /// Returns a factor for a pattern; patterns are the same only if they are the same object. Calls `analyze`
    /// unless the pattern is one of the last two asked for.
    std::shared_ptr<Factor> get(const std::shared_ptr<const SparsePattern>& pattern, const Analyze& analyze);
    /// Takes back a factor that nobody else uses, for the next caller of get(): fresh memory costs page faults.
    /// Large factors are freed instead.
    void store(std::shared_ptr<Factor> factor);
    /// Returns the number of analyses so far.
    int analyses() const { return analyses_; }

  private:
    struct Shelf {
        std::unique_ptr<Factor> analysed;
        std::shared_ptr<Factor> spare;
    };

    Shelf* shelf_of(const std::shared_ptr<const SparsePattern>& pattern);

    std::array<Shelf, 2> shelves_;  // the one asked for last comes first
    int analyses_ = 0;
};

}  // namespace magshell
