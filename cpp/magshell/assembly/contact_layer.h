// A second matrix for the blocks between nodes of bodies in contact; its pattern follows the pairs that are near.
//
// The pattern of the scene's own matrix stays fixed. Contacts change, so this one couples more nodes than are in contact, and is rebuilt
// only if some pair is not coupled by it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "magshell/assembly/system_matrix.h"

namespace magshell {

class ContactLayer {
  public:
    /// The nodes that a pair couples with each other; negative entries are absent.
    using Group = std::array<Index, 4>;

    /// Makes an empty layer for a scene with these numbers of nodes and edge rotations.
    ContactLayer(Index nodes, Index rotations) : matrix_(nodes, rotations, {}) {}

    /// Returns true if all nodes of a group are coupled.
    bool couples(const Group& group) const;
    /// Couples these groups, and keeps those that it couples already as long as they are not too many.
    void add_couplings(std::vector<Group> groups);
    /// Sets whether the layer is added to the scene's matrix from the next assembly on; at first it is not.
    void use(bool used) { used_ = used; }
    bool used() const { return used_; }
    /// Returns how often its pattern has changed; at first it couples nothing.
    std::int64_t version() const { return version_; }

    /// Adds the lower blocks (i, j), i >= j, of nodes that it couples: block(i, j) returns a Mat3.
    template <std::size_t count, class Block>
    void add(const std::array<Index, count>& group, const Block& block) {
        for (std::size_t i = 0; i < count && group[i] >= 0; ++i) {
            matrix_.add_diagonal_block(group[i], block(i, i));
            for (std::size_t j = 0; j < i; ++j) {
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

/// Computes the lower triangle of the sum of two matrices, or of the first alone if `layer` is null.
void merge(const SystemMatrix& matrix, const SystemMatrix* layer, std::vector<Index>& column_starts,
           std::vector<Index>& rows, LargeVector<double>& values);

}  // namespace magshell
