// Fills SIMD vectors, with one element per lane, from per-element data, and reads them: lane l of group k is element k * width + l.
#pragma once

#include <utility>
#include <vector>

#include "magshell/assembly/out_of_balance.h"
#include "magshell/assembly/system_matrix.h"
#include "magshell/core/vector3.h"
#include "magshell/energy/symmetric3.h"

namespace magshell {

constexpr Index groups_for(Index elements) {
    return (elements + SimdDouble::width - 1) / SimdDouble::width;
}

/// Returns the element of a lane. Lanes past the end repeat the last element and are never scattered.
inline Index element_of(Index group, int lane, Index elements) {
    const Index element = group * SimdDouble::width + lane;
    return element < elements ? element : elements - 1;
}

/// Returns a SIMD vector with number(lane) in each lane. It is built in registers, because lanes written one by one to memory would wait for each
/// other.
template <class Number>
inline SimdDouble simd_of(const Number& number) {
    return [&]<std::size_t... lane>(std::index_sequence<lane...>) {
        return SimdDouble(SimdDouble::Lanes{static_cast<double>(number(static_cast<int>(lane)))...});
    }(std::make_index_sequence<SimdDouble::width>());
}

/// Returns a SIMD vector of the vectors that begin at from(lane).
template <class From>
inline SimdVec3 vectors_of(const From& from) {
    const double* at[SimdDouble::width];
    for (int lane = 0; lane < SimdDouble::width; ++lane) at[lane] = from(lane);
    const auto component = [&](int c) { return simd_of([&](int lane) { return at[lane][c]; }); };
    return {component(0), component(1), component(2)};
}

inline void set_lane(SimdVec3& group, int lane, const double* from) {
    group.x.set(lane, from[0]);
    group.y.set(lane, from[1]);
    group.z.set(lane, from[2]);
}

inline void set_lane(SimdVec3& group, int lane, const Vec3& from) {
    set_lane(group, lane, from.data());
}

template <int N>
inline void set_lane(Symmetric<N>& group, int lane, const Eigen::Matrix<double, N, N>& from) {
    for (int i = 0; i < N; ++i)
        for (int j = 0; j <= i; ++j) group.at[lower_index(i, j)].set(lane, from(i, j));
}

inline Vec3 lane_of(const SimdDouble v[3], int lane) {
    return {v[0][lane], v[1][lane], v[2][lane]};
}

template <int N>
inline Eigen::Vector<double, N> lane_of(const SimdDouble v[N], int lane) {
    Eigen::Vector<double, N> numbers;
    for (int i = 0; i < N; ++i) numbers[i] = v[i][lane];
    return numbers;
}

inline Vec3 lane_of(const SimdVec3& v, int lane) {
    return {v.x[lane], v.y[lane], v.z[lane]};
}

inline void scatter_node(Residual& out, Index node, const SimdVec3& force, int lane) {
    out.add(3 * node, force.x[lane]);
    out.add(3 * node + 1, force.y[lane]);
    out.add(3 * node + 2, force.z[lane]);
}

/// Positions of the blocks of N nodes in the matrix: one slot per pair, at lower_index(row - 1, column).
template <int N>
using PairSlots = std::array<SystemMatrix::Slot, N*(N - 1) / 2>;

/// Marks a pair of places in an element that the same node takes, as across two edges of a face at a vertex with three faces.
constexpr SystemMatrix::Slot same_node = -2;

template <int N, class Nodes>
PairSlots<N> pair_slots(const SystemMatrix& matrix, const Nodes& nodes) {
    PairSlots<N> slots;
    for (int i = 1; i < N; ++i)
        for (int j = 0; j < i; ++j)
            slots[lower_index(i - 1, j)] = nodes[i] < 0 || nodes[j] < 0 ? -1
                                           : nodes[i] == nodes[j] ? same_node
                                                                  : matrix.node_slot(nodes[i], nodes[j]);
    return slots;
}

/// Adds the lower blocks (row, column), stored at lower_index(row, column), of one lane; absent nodes are skipped.
template <int N, class Nodes>
inline void scatter_blocks(SystemMatrix& matrix, const Nodes& nodes, const PairSlots<N>& slots,
                           const SimdMat3* blocks, int lane) {
    Index length[N];
    for (int i = 0; i < N; ++i) length[i] = nodes[i] < 0 ? 0 : matrix.column_length(nodes[i]);
    for (int i = 0; i < N; ++i) {
        if (nodes[i] < 0) continue;
        matrix.add_diagonal_block(nodes[i], blocks[lower_index(i, i)], lane);
        for (int j = 0; j < i; ++j) {
            const SystemMatrix::Slot slot = slots[lower_index(i - 1, j)];
            if (slot >= 0) matrix.add_block(slot, length[slot & 1 ? i : j], blocks[lower_index(i, j)], lane);
            if (slot == same_node) matrix.add_block_and_transpose(nodes[i], blocks[lower_index(i, j)], lane);
        }
    }
}

template <class T, class Allocator>
std::size_t bytes_of(const std::vector<T, Allocator>& values) {
    return values.capacity() * sizeof(T);
}

/// Sets the first lane of a block with zero diagonal to the skew-symmetric [axis]x.
inline void set_skew(SimdMat3& block, const Vec3& axis) {
    block.at[1].set(0, -axis.z());
    block.at[2].set(0, axis.y());
    block.at[3].set(0, axis.z());
    block.at[5].set(0, -axis.x());
    block.at[6].set(0, -axis.y());
    block.at[7].set(0, axis.x());
}

}  // namespace magshell
