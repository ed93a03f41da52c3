#include "magshell/linalg/multifrontal/factor_store.h"

#include <utility>

namespace magshell {

FactorStore::Shelf* FactorStore::shelf_of(const std::shared_ptr<const SparsePattern>& pattern) {
    for (Shelf& shelf : shelves_)
        if (shelf.analysed && shelf.analysed->pattern() == pattern) return &shelf;
    return nullptr;
}

std::shared_ptr<Factor> FactorStore::get(const std::shared_ptr<const SparsePattern>& pattern,
                                         const Analyze& analyze) {
    const Shelf* found = shelf_of(pattern);
    if (!found) {
        shelves_[1] = {};  // frees memory first
        shelves_[1].analysed = analyze();
        ++analyses_;
    }
    if (found != shelves_.data()) std::swap(shelves_[0], shelves_[1]);
    Shelf& shelf = shelves_[0];
    return shelf.spare ? std::exchange(shelf.spare, nullptr) : shelf.analysed->sibling();
}

void FactorStore::store(std::shared_ptr<Factor> factor) {
    // [bytes] that are freed, not stored; plain-words: ok
    constexpr std::size_t large = std::size_t{1} << 28;
    if (!factor || factor.use_count() > 1 || factor->bytes() > large) return;
    Shelf* shelf = shelf_of(factor->pattern());
    if (!shelf) return;
    factor->forget();
    shelf->spare = std::move(factor);
}

}  // namespace magshell
