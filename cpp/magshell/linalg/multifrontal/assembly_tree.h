// AssemblyTree: the fronts of a multifrontal factorization: which columns are eliminated together, and in what
// order.
#pragma once

#include <cstdint>
#include <vector>

#include "magshell/linalg/ordering/quotient_graph.h"

namespace magshell {

/// A front: consecutive columns ("pivots") that are eliminated together, and the rows below them that their
/// columns of L reach.
struct FrontShape {
    Index first = 0;  // the first pivot
    Index pivots = 0;
    Index below = 0;          // number of rows below the pivots
    Index parent = -1;        // the front that contains the first row below; -1 for a root
    std::ptrdiff_t rows = 0;  // position of its rows below in AssemblyTree::rows
};

/// Returns the number of multiplications and additions for eliminating `pivots` columns with `below` rows below
/// them.
double elimination_flops(double pivots, double below);

struct AssemblyTree {
    std::vector<Index> order;        // order[k] is the unknown eliminated k-th
    std::vector<FrontShape> fronts;  // every child before its parent, subtrees contiguous
    std::vector<Index> rows;         // in elimination order, ascending within a front

    double flops() const;           // multiplications and additions
    std::int64_t nonzeros() const;  // entries of L, its diagonal included, explicit zeros counted
};

/// Creates the tree. Columns with the same structure become one front, and fronts are merged where explicit
/// zeros cost less time than separate fronts. `order` is any fill-reducing ordering of the quotient's nodes;
/// the order of the tree is equivalent to it up to those zeros.
AssemblyTree assembly_tree(const Quotient& quotient, std::vector<Index> order);

}  // namespace magshell
