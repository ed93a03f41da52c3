// Colours the elements of all bodies, so that threads can scatter forces and Hessian blocks without conflicts.
//
// The elements of a body are cut into chunks of fixed length, those of a shell with the dihedral angles of which they are the first
// element. Chunks that share a node get different colours. The order of additions at a node is that of the colours for any number of
// threads, so results are bitwise identical. A chunk and its part of the Hessian fit in the cache of a core.
//
// One thread processes neighbouring chunks in succession, each after its neighbours of earlier colours, so that shared
// data is still in the cache. Many threads process segments of that order, one colour after another: chunks of one colour run in
// parallel, since no two of them add to one node, and a segment fits in the common cache.
#pragma once

#include <functional>
#include <vector>

#include "magshell/body/body.h"

namespace magshell {

struct Chunk {
    Index number;  // among the chunks of all bodies
    Index body;
    Index first, last;  // elements; `first` is a multiple of the pack width
    Index first_dihedral = 0, last_dihedral = 0;
};

/// The chunks of one body.
class ChunkLoop {
  public:
    /// Calls body(chunk) for every chunk, after its neighbours of earlier colours; body may scatter into shared arrays.
    void scatter(const std::function<void(const Chunk&)>& body) const;

    /// Calls body(chunk) for every chunk in any order; body may write only to its own elements and dihedral angles.
    void each(const std::function<void(const Chunk&)>& body) const;

    /// Returns the sum of body(chunk) over the chunks, added in their order.
    double sum(const std::function<double(const Chunk&)>& body) const;

  private:
    friend class ElementColoring;
    std::vector<Chunk> chunks_;
    std::vector<Index> order_;  // of chunks_, for one thread
    std::vector<std::vector<Index>>
        rounds_;  // of chunks_, for many threads: each in parallel, one after another
};

class ElementColoring {
  public:
    ElementColoring(Index nodes, const std::vector<const Body*>& bodies);
    ElementColoring(const ElementColoring&) = delete;
    ElementColoring& operator=(const ElementColoring&) = delete;

    const ChunkLoop& of(Index body) const { return loops_[body]; }

    /// Calls body(chunk) for the chunks of all bodies, as ChunkLoop::scatter does.
    void scatter(const std::function<void(const Chunk&)>& body) const { all_.scatter(body); }
    /// Returns the chunks in an order in which scatter may process them.
    std::vector<Chunk> in_order() const;

    std::size_t bytes() const;

  private:
    void cut(const Body& of, Index body);
    void set_order(Index nodes, const std::vector<const Body*>& bodies);

    ChunkLoop all_;
    std::vector<ChunkLoop> loops_;
};

}  // namespace magshell
