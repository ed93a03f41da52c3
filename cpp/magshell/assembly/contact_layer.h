// Blocks between nodes that touch: a matrix beside the scene's own, whose pattern follows what is near.
//
// The scene's own keeps its places. What touches changes, so that this one couples more nodes than touch, and is made
// anew only when some touch that it does not couple.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "magshell/assembly/system_matrix.h"

namespace magshell {

class ContactLayer {
  public:
    /// Nodes that a pair couples with each other; negative: fewer.
    using Group = std::array<Index, 4>;

    /// Of a scene with so many nodes and rotations.
    ContactLayer(Index nodes, Index rotations) : matrix_(nodes, rotations, {}) {}

    /// Whether all nodes of a group are coupled.
    bool couples(const Group& group) const;
    /// Couples these groups from now on, and those that it couples already, as long as they are not too many more.
    void couple(std::vector<Group> groups);
    /// Whether the scene's matrix is to have it, from the next assembly on; at first not.
    void use(bool used) { used_ = used; }
    bool used() const { return used_; }
    /// How often its pattern has changed; at first it couples nothing.
    std::int64_t version() const { return version_; }

    /// Adds the lower blocks (i, j), i >= j, of a group that it couples: block(i, j) is a Mat3.
    template <class Block>
    void add(const Group& group, const Block& block) {
        for (int i = 0; i < 4 && group[i] >= 0; ++i) {
            matrix_.add_diagonal_block(group[i], block(i, i));
            for (int j = 0; j < i; ++j) {
                const SystemMatrix::Slot slot = matrix_.node_slot(group[i], group[j]);
                matrix_.add_block(slot, matrix_.column_length(group[slot & 1 ? i : j]), block(i, j));
            }
        }
    }

    SystemMatrix& matrix() { return matrix_; }
    const SystemMatrix& matrix() const { return matrix_; }
    std::size_t bytes() const { return matrix_.bytes() + groups_.capacity() * sizeof(Group); }

  private:
    SystemMatrix matrix_;
    std::vector<Group> groups_;  // sorted, each once
    std::int64_t version_ = 0;
    bool used_ = false;
};

/// The lower triangle of the sum of two matrices, of the first alone where there is no second.
void merge(const SystemMatrix& matrix, const SystemMatrix* layer, std::vector<Index>& column_starts,
           std::vector<Index>& rows, LargeVector<double>& values);

}  // namespace magshell
