// Colours the elements of all bodies, so that threads can scatter forces and Hessian blocks without conflicts.
//
// The elements of a body are cut into blocks of fixed length, those of a shell with the dihedral angles of which they are the first
// element. Blocks that share a node get different colours. The order of additions at a node is that of the colours for any number of
// threads, so results are bitwise identical. A block and its part of the Hessian fit in the cache of a core.
//
// One thread processes neighbouring blocks in succession, each after its neighbours of earlier colours, so that shared
// data is still in the cache. Many threads process segments of that order, one colour after another: blocks of one colour run in
// parallel, since no two of them add to one node, and a segment fits in the common cache.
#pragma once

#include <functional>
#include <vector>

#include "magshell/body/body.h"

namespace magshell {

struct ElementBlock {
    Index number;  // among the blocks of all bodies
    Index body;
    Index first, last;  // elements; `first` is a multiple of the SIMD width
    Index first_dihedral = 0, last_dihedral = 0;
};

/// The blocks of one body.
class ColoredLoop {
  public:
    /// Calls body(element_block) for every block, after its neighbours of earlier colours; body may scatter into shared arrays.
    void scatter(const std::function<void(const ElementBlock&)>& body) const;

    /// Calls body(element_block) for every block in any order; body may write only to its own elements and dihedral angles.
    void each(const std::function<void(const ElementBlock&)>& body) const;

    /// Returns the sum of body(element_block) over the blocks, added in their order.
    double sum(const std::function<double(const ElementBlock&)>& body) const;

  private:
    friend class ElementColoring;
    std::vector<ElementBlock> element_blocks_;
    std::vector<Index> order_;  // of element_blocks_, for one thread
    std::vector<std::vector<Index>>
        rounds_;  // of element_blocks_, for many threads: each in parallel, one after another
};

class ElementColoring {
  public:
    ElementColoring(Index nodes, const std::vector<const Body*>& bodies);
    ElementColoring(const ElementColoring&) = delete;
    ElementColoring& operator=(const ElementColoring&) = delete;

    const ColoredLoop& of(Index body) const { return loops_[body]; }

    /// Calls body(element_block) for the blocks of all bodies, as ColoredLoop::scatter does.
    void scatter(const std::function<void(const ElementBlock&)>& body) const { all_.scatter(body); }
    /// Returns the blocks in an order in which scatter may process them.
    std::vector<ElementBlock> in_order() const;

    std::size_t bytes() const;

  private:
    void cut(const Body& of, Index body);
    void set_order(Index nodes, const std::vector<const Body*>& bodies);

    ColoredLoop all_;
    std::vector<ColoredLoop> loops_;
};

}  // namespace magshell
