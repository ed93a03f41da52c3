// Which parts of a sheet may be scattered at the same time.
//
// Faces are cut into parts of fixed length, each with the folds that it is first to touch, and parts that
// share a node get different colours. Colours follow each other, parts of one colour run in parallel: no two
// threads add to one place, and the order of additions at a place is that of the colours, whatever the number
// of threads. Same bits on one thread and on many. A part also fits in a core's cache with its share of the
// Hessian.
#pragma once

#include <functional>
#include <vector>

#include "magshell/assembly/sheet.h"

namespace magshell {

struct Part {
    Index number;
    Index first_face, last_face;  // first_face is a multiple of every pack width
    Index first_fold, last_fold;
};

class Schedule {
  public:
    explicit Schedule(const Sheet& sheet);

    /// body(part) for every part, colour after colour, where body scatters into shared arrays.
    void scatter(const std::function<void(const Part&)>& body) const;

    /// The parts in an order in which scatter may come to them.
    std::vector<Part> in_order() const;

    /// body(part) for every part at once, where body writes only to its own faces and folds.
    void each(const std::function<void(const Part&)>& body) const;

    /// The sum of body(part) over the parts, added up in their order.
    double sum(const std::function<double(const Part&)>& body) const;

    std::size_t bytes() const;

  private:
    void colour(const Sheet& sheet);

    std::vector<Part> parts_;
    std::vector<std::vector<Index>> colours_;
};

}  // namespace magshell
