// Which points and triangles, and which edges, of surfaces are near each other, where they are or on their way.
//
// Everything is found through pairs of faces whose boxes are near: each vertex and each edge goes with one of its faces.
// The order depends on nothing but the numbers of what is found.
//
// A point above a flat mesh has as many triangles near it as there are around the vertex or edge below it, at the same
// distance. What they count too often is taken back by pairs of the point and an edge (- 1 for two triangles) and of the
// point and a vertex (+ 1 for a closed fan), with negative areas, so that a flat mesh is as good as a plane [Li et al.
// 2023, convergent incremental potential contact]. The sum is what the nearest gives or more where all that is near hangs
// together without a hole, as it does around any place that a point touches, so that it grows without bound there; a ring
// of faces around a point counts less.
//
// Areas: of a point and a triangle half of the vertex's, as the other side has its vertices too; of two edges a quarter
// of the smaller one's, so that a coarse edge across many fine ones counts no more than it covers.
#pragma once

#include <optional>

#include "magshell/contact/face_boxes.h"
#include "magshell/contact/near_pair.h"

namespace magshell {

/// Surfaces that may touch each other; one and the same: itself.
struct SurfacePair {
    Index a, b;
};

class BroadPhase {
  public:
    BroadPhase(std::vector<ContactSurface> surfaces, std::vector<SurfacePair> contacts);
    BroadPhase(BroadPhase&&) = default;
    BroadPhase(const BroadPhase&) = delete;  // the boxes know their surfaces

    /// Gives half their rest distance as their room to the pairs that are nearer at rest than `near_at_rest` (one a
    /// contact, [m]: twice reach and thickness), because they are neighbours on a surface. rest: where nodes are at rest.
    void make_room(const std::vector<Vec3>& rest, const std::vector<double>& near_at_rest);

    /// Two neighbours, and how far they are from each other at rest [m].
    struct NeighbourPair {
        double distance;
        NearPair near;
    };
    /// Of a contact, those that are nearest each other of all to which it gave room; empty: to none.
    const std::optional<NeighbourPair>& nearest_neighbours(Index contact) const { return nearest_[contact]; }

    const std::vector<ContactSurface>& surfaces() const { return surfaces_; }

    /// Pairs that share a node are left out, here and below.
    /// The pairs nearer than a contact's `margins` [m] with nodes at q, and what takes back double counts.
    std::vector<NearPair> near(const double* q, const std::vector<double>& margins);
    /// The points and triangles, and the edges, that may come nearer than that on straight ways of their nodes from q to
    /// `end`: all that do, and some whose boxes do.
    std::vector<NearPair> near_along_path(const double* q, const double* end,
                                          const std::vector<double>& margins);
    /// Pairs of an edge (first) and a triangle (second) that pass through each other with nodes at q, as faces:
    /// contact, first_face, second_face, swapped.
    std::vector<NearPair> crossings(const double* q);

    std::size_t bytes() const;

  private:
    /// In the order in which they come out.
    enum class Sort { of_a_on_b, of_b_on_a, edges };
    /// The numbers of a vertex and a face, or of two edges, in one that sorts them.
    using Key = std::uint64_t;
    struct Keys {
        std::vector<Key> of[3];
    };
    /// Rooms of neighbours, by key: sorted.
    struct Rooms {
        std::vector<std::pair<Key, double>> of[3];
    };

    Keys find(Index contact, const NodePaths& ways, double margin) const;
    void fit(const NodePaths& ways);
    NearPair pair_of(Index contact, Sort sort, Key key) const;

    std::vector<ContactSurface> surfaces_;
    std::vector<SurfacePair> contacts_;
    std::vector<FaceBoxes> boxes_;  // of each surface
    std::vector<Rooms> rooms_;      // of each contact
    std::vector<std::optional<NeighbourPair>> nearest_;
};

}  // namespace magshell
