// Entries of the system matrix in the rows of one rigid body or skeleton, grouped by links: the forces that a column exerts on a link
// are summed to one wrench.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "magshell/dofs/link_twists.h"

namespace magshell {

class LinkCoupling {
  public:
    /// Adds the matrix entry at `from`, in this row of the system, which belongs to this link. at: its column, in a numbering of the
    /// caller. Entries of one column and link must be added one after another.
    void add(Index from, Index row, Index link, Index at, double factor = 1.0) {
        const Index end = static_cast<Index>(entries_.size());
        if (runs_.empty() || runs_.back().link != link || runs_.back().at != at ||
            runs_.back().factor != factor)
            runs_.push_back({end, link, at, -1, factor});
        entries_.push_back({from, row});
        ++runs_.back().end;
    }
    /// Adds an entry whose column belongs to the link of_column, too: runs are summed to 6 x 6 blocks.
    void add(Index from, Index row, Index link, Index column, Index of_column, double factor) {
        add(from, row, link, column, factor);
        Run& run = runs_.back();
        if (run.block >= 0) return;
        const auto [found, fresh] =
            numbers_.try_emplace({link, of_column}, static_cast<Index>(blocks_.size()));
        if (fresh) blocks_.push_back({link, of_column, Mat6::Zero()});
        run.block = found->second;
    }

    /// Adds B^T K for columns that belong to no link, for the first n coordinates, to values + at.
    void add_columns(const double* entries, const LinkTwists& rows, Index n, double* values) const {
        each_run(entries, rows,
                 [&](const Run& run, const Vec6& a) { rows.add_wrench(run.link, a, n, values + run.at); });
    }
    /// Returns N^T K N by pairs of links, where N maps twists of links to velocities of nodes.
    std::vector<LinkTwists::Block> blocks(const double* entries, const LinkTwists& rows,
                                          const LinkTwists& columns) const {
        std::vector<LinkTwists::Block> sums = blocks_;
        each_run(entries, rows, [&](const Run& run, const Vec6& a) {
            sums[run.block].value += run.factor * a * columns.wrench(run.at).transpose();
        });
        return sums;
    }

    bool empty() const { return runs_.empty(); }
    std::size_t bytes() const {
        return entries_.capacity() * sizeof(Entry) + runs_.capacity() * sizeof(Run) +
               blocks_.capacity() * sizeof(LinkTwists::Block);
    }

  private:
    struct Entry {
        Index from, row;
    };
    struct Run {
        Index end, link, at, block;
        double factor;
    };

    template <class Do>
    void each_run(const double* entries, const LinkTwists& rows, const Do& act) const {
        Index k = 0;
        for (const Run& run : runs_) {
            Vec6 a = Vec6::Zero();
            for (; k < run.end; ++k) rows.add_force(entries_[k].row, entries[entries_[k].from], a);
            act(run, a);
        }
    }

    std::vector<Entry> entries_;
    std::vector<Run> runs_;
    std::vector<LinkTwists::Block> blocks_;  // without values
    std::map<std::pair<Index, Index>, Index> numbers_;
};

}  // namespace magshell
