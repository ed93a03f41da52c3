// Which chunks of the bodies may be scattered at the same time.
//
// The elements of a body are cut into chunks of fixed length, those of a sheet each with the folds that it is
// first to touch, and chunks that share a node get different colours. Colours follow each other, chunks of one
// colour run in parallel: no two threads add to one place, and the order of additions at a place is that of
// the colours, whatever the number of threads. Same bits on one thread and on many. A chunk also fits in a
// core's cache with its share of the Hessian.
#pragma once

#include <functional>
#include <vector>

#include "magshell/body/body.h"

namespace magshell {

struct Chunk {
    Index number;  // among those of all bodies
    Index body;
    Index first, last;  // elements; the first is a multiple of every pack width
    Index first_fold = 0, last_fold = 0;
};

/// The chunks of one body.
class ChunkLoop {
  public:
    /// body(chunk) for every chunk, colour after colour, where body scatters into shared arrays.
    void scatter(const std::function<void(const Chunk&)>& body) const;

    /// body(chunk) for every chunk at once, where body writes only to its own elements and folds.
    void each(const std::function<void(const Chunk&)>& body) const;

    /// The sum of body(chunk) over the chunks, added up in their order.
    double sum(const std::function<double(const Chunk&)>& body) const;

  private:
    friend class Schedule;
    std::vector<Chunk> chunks_;
    std::vector<std::vector<Index>> colours_;  // of chunks_
};

class Schedule {
  public:
    Schedule(Index nodes, const std::vector<const Body*>& bodies);
    Schedule(const Schedule&) = delete;
    Schedule& operator=(const Schedule&) = delete;

    const ChunkLoop& of(Index body) const { return loops_[body]; }

    /// body(chunk) for the chunks of all bodies, colour after colour.
    void scatter(const std::function<void(const Chunk&)>& body) const { all_.scatter(body); }
    /// The chunks in an order in which scatter may come to them.
    std::vector<Chunk> in_order() const;

    std::size_t bytes() const;

  private:
    void cut(const Body& of, Index body);
    void colour(Index nodes, const std::vector<const Body*>& bodies);

    ChunkLoop all_;
    std::vector<ChunkLoop> loops_;
};

}  // namespace magshell
