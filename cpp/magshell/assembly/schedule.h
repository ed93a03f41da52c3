// Which chunks of the bodies may be scattered at the same time.
//
// The elements of a body are cut into chunks of fixed length, those of a sheet each with the folds that it is
// first to touch, and chunks that share a node get different colours. The order of additions at a place is that of
// the colours, whatever the number of threads: same bits on one thread and on many. A chunk fits in a core's cache
// with its share of the Hessian.
//
// One thread goes from a chunk to the next beside it, after those beside it of earlier colours, so that what
// neighbours share is still in the cache. Many threads take stretches of that order, each colour after colour: chunks
// of one colour run in parallel, as no two of them add to one place, and a stretch fits in the cache of all cores.
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
    /// body(chunk) for every chunk, after those beside it of earlier colours, where body scatters into shared arrays.
    void scatter(const std::function<void(const Chunk&)>& body) const;

    /// body(chunk) for every chunk at once, where body writes only to its own elements and folds.
    void each(const std::function<void(const Chunk&)>& body) const;

    /// The sum of body(chunk) over the chunks, added up in their order.
    double sum(const std::function<double(const Chunk&)>& body) const;

  private:
    friend class Schedule;
    std::vector<Chunk> chunks_;
    std::vector<Index> order_;                // of chunks_, for one thread
    std::vector<std::vector<Index>> rounds_;  // of chunks_, for many: each in parallel, one after another
};

class Schedule {
  public:
    Schedule(Index nodes, const std::vector<const Body*>& bodies);
    Schedule(const Schedule&) = delete;
    Schedule& operator=(const Schedule&) = delete;

    const ChunkLoop& of(Index body) const { return loops_[body]; }

    /// body(chunk) for the chunks of all bodies, in such an order.
    void scatter(const std::function<void(const Chunk&)>& body) const { all_.scatter(body); }
    /// The chunks in an order in which scatter may come to them.
    std::vector<Chunk> in_order() const;

    std::size_t bytes() const;

  private:
    void cut(const Body& of, Index body);
    void set_order(Index nodes, const std::vector<const Body*>& bodies);

    ChunkLoop all_;
    std::vector<ChunkLoop> loops_;
};

}  // namespace magshell
