// Entries of the full matrix whose rows are those of a carrier, gathered by links: what a column of them does to a link is
// one wrench.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "magshell/assembly/link_twists.h"

namespace magshell {

class LinkCoupling {
  public:
    /// An entry of the matrix at `from`, in this row of the carrier, of that link. at: its column, whatever the caller
    /// counts; entries of one column and link are to come one after another.
    void add(Index from, Index row, Index link, Index at, double factor = 1.0) {
        const Index end = static_cast<Index>(entries_.size());
        if (runs_.empty() || runs_.back().link != link || runs_.back().at != at ||
            runs_.back().factor != factor)
            runs_.push_back({end, link, at, -1, factor});
        entries_.push_back({from, row});
        ++runs_.back().end;
    }
    /// The same, with the link that the column is of: runs add up to blocks.
    void add(Index from, Index row, Index link, Index column, Index of_column, double factor) {
        add(from, row, link, column, factor);
        Run& run = runs_.back();
        if (run.block >= 0) return;
        const auto [found, fresh] =
            numbers_.try_emplace({link, of_column}, static_cast<Index>(blocks_.size()));
        if (fresh) blocks_.push_back({link, of_column, Mat6::Zero()});
        run.block = found->second;
    }

    /// Adds B^T K of columns that no link moves, for the first n coordinates, where `at` says.
    void add_columns(const double* entries, const LinkTwists& rows, Index n, double* values) const {
        each_run(entries, rows,
                 [&](const Run& run, const Vec6& a) { rows.add_wrench(run.link, a, n, values + run.at); });
    }
    /// N^T K N by links.
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
