// Gathers the nodes of a SIMD vector of elements with N nodes, and scatters their forces and Hessian blocks.
#pragma once

#include <cstdint>

#include "magshell/assembly/element_blocks.h"
#include "magshell/assembly/element_coloring.h"

namespace magshell {

template <int N>
class ElementLoop {
  public:
    ElementLoop(const std::vector<std::array<Index, N>>& nodes, const ColoredLoop& element_blocks,
                const SystemMatrix& matrix)
        : elements_(static_cast<Index>(nodes.size())), nodes_(&nodes), element_blocks_(element_blocks) {
        slots_.reserve(elements_);
        for (const std::array<Index, N>& each : nodes) slots_.push_back(pair_slots<N>(matrix, each));
        turned_.resize(groups(), {});
        for (Index group = 0; group < groups(); ++group)
            for (std::size_t pair = 0; pair < turned_[group].size(); ++pair)
                for (int lane = 0; lane < lanes_in(group); ++lane)
                    turned_[group][pair] |= (slots_[element(group, lane)][pair] & 1) << lane;
    }

    Index groups() const { return groups_for(elements_); }
    int lanes_in(Index group) const {
        return std::min(SimdDouble::width, elements_ - group * SimdDouble::width);
    }
    Index element(Index group, int lane) const { return element_of(group, lane, elements_); }

    void gather(Index group, const double* q, SimdVec3 x[N]) const {
        const std::array<Index, N>* at[SimdDouble::width];
        for (int lane = 0; lane < SimdDouble::width; ++lane) at[lane] = &(*nodes_)[element(group, lane)];
        for (int k = 0; k < N; ++k) x[k] = vectors_of([&](int lane) { return q + 3 * (*at[lane])[k]; });
    }

    void scatter(Index group, const SimdVec3 g[N], Residual& out) const {
        for (int lane = 0; lane < lanes_in(group); ++lane)
            for (int k = 0; k < N; ++k) scatter_node(out, (*nodes_)[element(group, lane)][k], g[k], lane);
    }

    /// Adds the lower blocks (row, column), stored at lower_index(row, column). Blocks that belong to the upper triangle of the matrix
    /// are transposed in place first.
    void scatter(Index group, SimdMat3 h[N * (N + 1) / 2], SystemMatrix& out) const {
        for (int i = 1; i < N; ++i)
            for (int j = 0; j < i; ++j)
                transpose_in(turned_[group][lower_index(i - 1, j)], h[lower_index(i, j)]);
        for (int lane = 0; lane < lanes_in(group); ++lane) {
            const Index e = element(group, lane);
            const std::array<Index, N>& nodes = (*nodes_)[e];
            Index length[N];
            for (int i = 0; i < N; ++i) length[i] = out.column_length(nodes[i]);
            for (int i = 0; i < N; ++i) {
                out.add_diagonal_block(nodes[i], h[lower_index(i, i)], lane);
                for (int j = 0; j < i; ++j) {
                    const SystemMatrix::Slot slot = slots_[e][lower_index(i - 1, j)];
                    const SimdMat3& block = h[lower_index(i, j)];
                    if (slot == same_node)
                        out.add_block_and_transpose(nodes[i], block, lane);
                    else  // length without a branch, because whether a block is transposed is unpredictable
                        out.add_lower_block(slot >> 1, length[j + (i - j) * (slot & 1)], block, lane);
                }
            }
        }
    }

    /// Calls body(group) for the SIMD vectors of a block.
    template <class Body>
    static void over_groups(const ElementBlock& element_block, const Body& body) {
        for (Index group = element_block.first / SimdDouble::width; group < groups_for(element_block.last);
             ++group)
            body(group);
    }

    /// Calls body(group) for all SIMD vectors in the order of the element coloring, so that body may scatter.
    template <class Body>
    void scatter_groups(const Body& body) const {
        element_blocks_.scatter([&](const ElementBlock& element_block) { over_groups(element_block, body); });
    }

    /// Calls body(group) for all SIMD vectors in any order; body may write only what belongs to the SIMD vector.
    template <class Body>
    void each_group(const Body& body) const {
        element_blocks_.each([&](const ElementBlock& element_block) { over_groups(element_block, body); });
    }

    /// Returns the sum of energy(group) over the elements [J].
    template <class Energy>
    double sum(const Energy& energy) const {
        return element_blocks_.sum([&](const ElementBlock& element_block) {
            double total = 0.0;
            over_groups(element_block, [&](Index group) {
                const SimdDouble shares = energy(group);
                for (int lane = 0; lane < lanes_in(group); ++lane) total += shares[lane];
            });
            return total;
        });
    }

    std::size_t bytes() const { return bytes_of(slots_) + bytes_of(turned_); }

  private:
    Index elements_;
    const std::vector<std::array<Index, N>>* nodes_;
    const ColoredLoop& element_blocks_;
    LargeVector<PairSlots<N>> slots_;
    // Per SIMD vector and pair of nodes: a bit for each lane whose block has its rows at the node with the lower number.
    std::vector<std::array<std::uint8_t, N*(N - 1) / 2>> turned_;
};

/// The element loop over triangles.
class FaceLoop : public ElementLoop<3> {
  public:
    using ElementLoop<3>::ElementLoop;

    Index face(Index group, int lane) const { return element(group, lane); }
};

}  // namespace magshell
