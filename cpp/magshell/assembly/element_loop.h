// What every term on elements of N nodes shares: fetching the nodes of a pack of elements, and adding forces and
// blocks to them.
#pragma once

#include "magshell/assembly/lanes.h"
#include "magshell/assembly/schedule.h"

namespace magshell {

template <int N>
class ElementLoop {
  public:
    ElementLoop(const std::vector<std::array<Index, N>>& nodes, const ChunkLoop& chunks,
                const SystemMatrix& matrix)
        : elements_(static_cast<Index>(nodes.size())), nodes_(&nodes), chunks_(chunks) {
        slots_.reserve(elements_);
        for (const std::array<Index, N>& each : nodes) slots_.push_back(pair_slots<N>(matrix, each));
    }

    Index packs() const { return packs_for(elements_); }
    int lanes_in(Index pack) const { return std::min(Pack::width, elements_ - pack * Pack::width); }
    Index element(Index pack, int lane) const { return element_of(pack, lane, elements_); }

    void gather(Index pack, const double* q, Pack3 x[N]) const {
        for (int lane = 0; lane < Pack::width; ++lane) {
            const std::array<Index, N>& at = (*nodes_)[element(pack, lane)];
            for (int k = 0; k < N; ++k) set_lane(x[k], lane, q + 3 * at[k]);
        }
    }

    void scatter(Index pack, const Pack3 g[N], Residual& out) const {
        for (int lane = 0; lane < lanes_in(pack); ++lane)
            for (int k = 0; k < N; ++k) scatter_node(out, (*nodes_)[element(pack, lane)][k], g[k], lane);
    }

    void scatter(Index pack, const Pack33 h[N * (N + 1) / 2], SystemMatrix& out) const {
        for (int lane = 0; lane < lanes_in(pack); ++lane) {
            const Index e = element(pack, lane);
            scatter_blocks<N>(out, (*nodes_)[e], slots_[e], h, lane);
        }
    }

    /// body(pack) for the packs of a chunk.
    template <class Body>
    static void over_packs(const Chunk& chunk, const Body& body) {
        for (Index pack = chunk.first / Pack::width; pack < packs_for(chunk.last); ++pack) body(pack);
    }

    /// body(pack) for all packs, in the schedule's order, where body scatters.
    template <class Body>
    void scatter_packs(const Body& body) const {
        chunks_.scatter([&](const Chunk& chunk) { over_packs(chunk, body); });
    }

    /// body(pack) for all packs, where body writes only what belongs to them.
    template <class Body>
    void each_pack(const Body& body) const {
        chunks_.each([&](const Chunk& chunk) { over_packs(chunk, body); });
    }

    /// The sum of energy(pack) over the elements.
    template <class Energy>
    double sum(const Energy& energy) const {
        return chunks_.sum([&](const Chunk& chunk) {
            double total = 0.0;
            over_packs(chunk, [&](Index pack) {
                const Pack shares = energy(pack);
                for (int lane = 0; lane < lanes_in(pack); ++lane) total += shares[lane];
            });
            return total;
        });
    }

    std::size_t bytes() const { return bytes_of(slots_); }

  private:
    Index elements_;
    const std::vector<std::array<Index, N>>* nodes_;
    const ChunkLoop& chunks_;
    std::vector<PairSlots<N>> slots_;
};

}  // namespace magshell
