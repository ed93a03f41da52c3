// Which elements may be scattered at the same time.
//
// Elements are cut into chunks of fixed length, and chunks that share a node get different colours. Colours follow
// each other, chunks of one colour run in parallel: no two threads add to one place, and the order of additions
// at a place is that of the colours, whatever the number of threads. Same bits on one thread and on many.
#pragma once

#include <functional>
#include <vector>

#include "magshell/core/types.h"

namespace magshell {

class Schedule {
  public:
    static constexpr Index chunk_length = 256;  // elements; a multiple of every pack width

    Schedule() = default;
    /// `nodes_of` gives each element's nodes, negative ones are passed over.
    Schedule(Index elements, Index nodes, const std::function<std::vector<Index>(Index)>& nodes_of);

    /// body(first, last) for every chunk, colour after colour, where body scatters into shared arrays.
    void scatter(const std::function<void(Index, Index)>& body) const;

    /// body(first, last) for every chunk at once, where body writes only to its own elements.
    void each(const std::function<void(Index, Index)>& body) const;

    /// The sum of body(first, last) over the chunks, added up in their order.
    double sum(const std::function<double(Index, Index)>& body) const;

    std::size_t bytes() const;

  private:
    Index elements_ = 0, chunks_ = 0;
    std::vector<std::vector<Index>> colours_;
};

}  // namespace magshell
