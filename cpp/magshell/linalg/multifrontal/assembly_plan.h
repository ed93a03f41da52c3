// AssemblyPlan: the memory layout of a factorization, computed once per pattern: the positions of matrix
// entries in fronts and of updates in parents, and the part of the work space that each update occupies while
// it lives.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "magshell/linalg/multifrontal/assembly_tree.h"

namespace magshell {

/// Rows of one slab of an update that are added to one slab of the parent. Lane l of the parent receives lane
/// from[l] of the update, or nothing if from[l] is 8.
struct Transfer {
    Index slab;         // of the update
    Index parent_slab;  // of the parent's pivots if to_pivots, else of its rows below
    Index end_column;   // one past the last of these rows: the triangle needs no column beyond it
    bool to_pivots;
    std::array<std::uint8_t, 8> from;
};

/// A matrix entry and its position in its front's panel [doubles].
struct RoutedEntry {
    Index entry;
    Index place;
};

struct FrontPlan {
    FrontShape shape;
    std::ptrdiff_t panel = 0;  // position of its columns of L in the factor's storage [doubles]
    // position of its update in the shared work space, or in that of its subtree [doubles]
    std::ptrdiff_t update = 0;
    Index first_entry = 0, first_transfer = 0;
    Index rows_in_parent_pivots = 0;  // number of its rows below that are pivots of the parent
    std::vector<Index> children;
};

/// Fronts that depend on no others, processed by one thread.
struct Subtree {
    Index begin, end;          // range of its fronts, the root last
    Index first, unknowns;     // range of unknowns that they eliminate
    std::ptrdiff_t local = 0;  // position of its vector among those of all subtrees [doubles]
};

struct AssemblyPlan {
    std::vector<Index> order;
    std::vector<FrontPlan> fronts;  // plus one more, for the ends of entries and transfers
    std::vector<Index> rows;        // rows below the pivots of each front, from shape.rows on
    // position of those rows in the parent: among its pivots, or among its rows below
    std::vector<Index> places;
    // position of those rows in the vector of the subtree; for top fronts in the whole vector
    std::vector<Index> targets;
    std::vector<RoutedEntry> entries;
    std::vector<Transfer> transfers;
    std::vector<Subtree> subtrees;          // independent of the number of threads
    std::vector<Index> top;                 // the fronts above the subtrees, in order
    Index most_pivots = 0, most_below = 0;  // of any front
    // Size of the vectors of all subtrees: their unknowns, then one number per row below their roots.
    std::ptrdiff_t local_doubles = 0;
    // Updates of top fronts and of the roots of subtrees are in a work space that all threads share; those
    // within a subtree are in one that belongs to its thread.
    std::ptrdiff_t factor_doubles = 0, shared_doubles = 0, subtree_doubles = 0;

    Index front_count() const { return static_cast<Index>(fronts.size()) - 1; }
};

AssemblyPlan assembly_plan(const SparsePattern& pattern, AssemblyTree tree);

}  // namespace magshell
