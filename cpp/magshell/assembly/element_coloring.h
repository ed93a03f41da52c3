// Colours the elements of all bodies, so that threads can scatter forces and Hessian blocks without conflicts.
//
// The elements of each body are cut into blocks of fixed length, so short that a block and its part of the Hessian fit in the cache of one core.
// A block of a shell also has the dihedral angles whose first element it contains. Blocks that share a node get different colours, and
// add to that node in the order of their colours, with any number of threads; so results are bitwise identical.
//
// One thread processes the blocks by number, except that the neighbours of a block with earlier colours are processed before it. Blocks that
// share data follow each other closely, so the data is still in the cache.
// Several threads cut this order into segments that fit in the shared cache, and process each segment colour by colour. Blocks of one colour
// run in parallel, since no two of them add to the same node.
#pragma once

#include <functional>
#include <vector>

#include "magshell/body/body.h"

namespace magshell {

/// Consecutive elements of a body, from `first` up to but without `last`, and likewise its dihedral angles.
struct ElementBlock {
    Index number;  // among the blocks of all bodies
    Index body;
    Index first, last;  // `first` is a multiple of the SIMD width
    Index first_dihedral = 0, last_dihedral = 0;
};

/// Loops over the blocks of one body, or of all bodies.
class ColoredLoop {
  public:
    /// Calls body(element_block) for every block, in an order in which the function `body` may add to the nodes of the elements.
    void scatter(const std::function<void(const ElementBlock&)>& body) const;

    /// Calls body(element_block) for every block in any order, in parallel. `body` may write only to data of the block's elements and
    /// dihedral angles.
    void each(const std::function<void(const ElementBlock&)>& body) const;

    /// Returns the sum of body(element_block) over the blocks. They are computed in parallel and added by number.
    double sum(const std::function<double(const ElementBlock&)>& body) const;

  private:
    friend class ElementColoring;
    std::vector<ElementBlock> element_blocks_;
    std::vector<Index> order_;  // indices of the blocks in the order for one thread
    // The same for several threads: the blocks of a round run in parallel, the rounds one after another.
    std::vector<std::vector<Index>> rounds_;
};

/// The blocks of all bodies, with their colours.
class ElementColoring {
  public:
    /// nodes: number of nodes of the scene.
    ElementColoring(Index nodes, const std::vector<const Body*>& bodies);
    ElementColoring(const ElementColoring&) = delete;
    ElementColoring& operator=(const ElementColoring&) = delete;

    /// Returns the loop over the blocks of one body.
    const ColoredLoop& of(Index body) const { return loops_[body]; }

    /// Calls body(element_block) for the blocks of all bodies, as ColoredLoop::scatter does.
    void scatter(const std::function<void(const ElementBlock&)>& body) const { all_.scatter(body); }
    /// Returns the blocks of all bodies in the order in which one thread processes them.
    std::vector<ElementBlock> in_order() const;

    std::size_t bytes() const;

  private:
    /// Cuts the elements of a body into blocks.
    void cut(const Body& of, Index body);
    /// Colours the blocks, and sets the orders of all loops.
    void set_order(Index nodes, const std::vector<const Body*>& bodies);

    ColoredLoop all_;
    std::vector<ColoredLoop> loops_;
};

}  // namespace magshell
