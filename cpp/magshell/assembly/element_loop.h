// Gathers the nodes of a pack of elements with N nodes, and scatters their forces and Hessian blocks.
#pragma once

#include <cstdint>

#include "magshell/assembly/element_blocks.h"
#include "magshell/assembly/element_coloring.h"

namespace magshell {

template <int N>
class ElementLoop {
  public:
    ElementLoop(const std::vector<std::array<Index, N>>& nodes, const ChunkLoop& chunks,
                const SystemMatrix& matrix)
        : elements_(static_cast<Index>(nodes.size())), nodes_(&nodes), chunks_(chunks) {
        slots_.reserve(elements_);
        for (const std::array<Index, N>& each : nodes) slots_.push_back(pair_slots<N>(matrix, each));
        turned_.resize(packs(), {});
        for (Index pack = 0; pack < packs(); ++pack)
            for (std::size_t pair = 0; pair < turned_[pack].size(); ++pair)
                for (int lane = 0; lane < lanes_in(pack); ++lane)
                    turned_[pack][pair] |= (slots_[element(pack, lane)][pair] & 1) << lane;
    }

    Index packs() const { return packs_for(elements_); }
    int lanes_in(Index pack) const { return std::min(Pack::width, elements_ - pack * Pack::width); }
    Index element(Index pack, int lane) const { return element_of(pack, lane, elements_); }

    void gather(Index pack, const double* q, Pack3 x[N]) const {
        const std::array<Index, N>* at[Pack::width];
        for (int lane = 0; lane < Pack::width; ++lane) at[lane] = &(*nodes_)[element(pack, lane)];
        for (int k = 0; k < N; ++k) x[k] = vectors_of([&](int lane) { return q + 3 * (*at[lane])[k]; });
    }

    void scatter(Index pack, const Pack3 g[N], Residual& out) const {
        for (int lane = 0; lane < lanes_in(pack); ++lane)
            for (int k = 0; k < N; ++k) scatter_node(out, (*nodes_)[element(pack, lane)][k], g[k], lane);
    }

    /// Adds the lower blocks (row, column), stored at lower_index(row, column). Blocks that belong to the upper triangle of the matrix
    /// are transposed in place first.
    void scatter(Index pack, Pack33 h[N * (N + 1) / 2], SystemMatrix& out) const {
        for (int i = 1; i < N; ++i)
            for (int j = 0; j < i; ++j)
                transpose_in(turned_[pack][lower_index(i - 1, j)], h[lower_index(i, j)]);
        for (int lane = 0; lane < lanes_in(pack); ++lane) {
            const Index e = element(pack, lane);
            const std::array<Index, N>& nodes = (*nodes_)[e];
            Index length[N];
            for (int i = 0; i < N; ++i) length[i] = out.column_length(nodes[i]);
            for (int i = 0; i < N; ++i) {
                out.add_diagonal_block(nodes[i], h[lower_index(i, i)], lane);
                for (int j = 0; j < i; ++j) {
                    const SystemMatrix::Slot slot = slots_[e][lower_index(i - 1, j)];
                    const Pack33& block = h[lower_index(i, j)];
                    if (slot == same_node)
                        out.add_block_and_transpose(nodes[i], block, lane);
                    else  // length without a branch, because whether a block is transposed is unpredictable
                        out.add_lower_block(slot >> 1, length[j + (i - j) * (slot & 1)], block, lane);
                }
            }
        }
    }

    /// Calls body(pack) for the packs of a chunk.
    template <class Body>
    static void over_packs(const Chunk& chunk, const Body& body) {
        for (Index pack = chunk.first / Pack::width; pack < packs_for(chunk.last); ++pack) body(pack);
    }

    /// Calls body(pack) for all packs in the order of the element coloring, so that body may scatter.
    template <class Body>
    void scatter_packs(const Body& body) const {
        chunks_.scatter([&](const Chunk& chunk) { over_packs(chunk, body); });
    }

    /// Calls body(pack) for all packs in any order; body may write only what belongs to the pack.
    template <class Body>
    void each_pack(const Body& body) const {
        chunks_.each([&](const Chunk& chunk) { over_packs(chunk, body); });
    }

    /// Returns the sum of energy(pack) over the elements [J].
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

    std::size_t bytes() const { return bytes_of(slots_) + bytes_of(turned_); }

  private:
    Index elements_;
    const std::vector<std::array<Index, N>>* nodes_;
    const ChunkLoop& chunks_;
    LargeVector<PairSlots<N>> slots_;
    // Per pack and pair of nodes: a bit for each lane whose block has its rows at the node with the lower number.
    std::vector<std::array<std::uint8_t, N*(N - 1) / 2>> turned_;
};

/// The element loop over triangles.
class FaceLoop : public ElementLoop<3> {
  public:
    using ElementLoop<3>::ElementLoop;

    Index face(Index pack, int lane) const { return element(pack, lane); }
};

}  // namespace magshell
