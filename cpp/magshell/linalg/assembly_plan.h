// Where everything goes during a factorization, worked out once for a pattern: matrix entries into fronts,
// updates into parents, and which part of a work space each update occupies while it lives.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "magshell/linalg/assembly_tree.h"

namespace magshell {

/// Rows of one slab of an update that land in one slab of the parent. Lane l of the parent receives lane
/// from[l] of the update, or nothing where from[l] is 8.
struct Transfer {
    Index slab;         // of the update
    Index parent_slab;  // of the parent's pivots if to_pivots, else of its rows below
    Index end_column;   // one past the last of these rows: the triangle needs no column beyond it
    bool to_pivots;
    std::array<std::uint8_t, 8> from;
};

/// A matrix entry and its place in its front's panel [doubles].
struct RoutedEntry {
    Index entry;
    Index place;
};

struct FrontPlan {
    FrontShape shape;
    std::ptrdiff_t panel = 0;   // its columns of L in the factor's storage [doubles]
    std::ptrdiff_t update = 0;  // its update in the shared work space, or in that of its subtree [doubles]
    Index first_entry = 0, first_transfer = 0;
    Index rows_in_parent_pivots = 0;  // how many of its rows below are pivots of the parent
    std::vector<Index> children;
};

/// Fronts that depend on no others, for one thread.
struct Subtree {
    Index begin, end;          // its fronts, the root last
    Index first, unknowns;     // what they eliminate
    std::ptrdiff_t local = 0;  // where its vector stands among those of all subtrees [doubles]
};

struct AssemblyPlan {
    std::vector<Index> order;
    std::vector<FrontPlan> fronts;  // and one more, for the ends of entries and transfers
    std::vector<Index> rows;        // below the pivots of each front, from shape.rows on
    std::vector<Index> places;      // of those rows in the parent: among its pivots, or among its rows below
    std::vector<Index> targets;     // of those rows in the vector of the subtree, or for top fronts of all
    std::vector<RoutedEntry> entries;
    std::vector<Transfer> transfers;
    std::vector<Subtree> subtrees;          // independent of the number of threads
    std::vector<Index> top;                 // the fronts above them, in order
    Index most_pivots = 0, most_below = 0;  // of a front
    // Of the vectors of all subtrees: their unknowns, then one number for each row below their roots.
    std::ptrdiff_t local_doubles = 0;
    // Updates of top fronts and of the roots of subtrees lie in one work space that all threads share, those
    // within a subtree in one that its thread has to itself.
    std::ptrdiff_t factor_doubles = 0, shared_doubles = 0, subtree_doubles = 0;

    Index front_count() const { return static_cast<Index>(fronts.size()) - 1; }
};

AssemblyPlan assembly_plan(const SparsePattern& pattern, AssemblyTree tree);

}  // namespace magshell
