// BroadPhase: finds the pairs of points and triangles, and of edges, of surfaces that are near each other, at
// one state or along straight paths.
//
// Pairs are found through pairs of faces whose bounding boxes are near: each vertex and each edge is assigned
// to one of its faces. The order of the result depends on nothing but the numbers of the vertices, edges and
// faces.
//
// A point above a flat mesh is near all triangles around the closest vertex or edge, at the same distance, and
// would be counted once for each. Pairs of the point with an edge (- 1 for two triangles) and with a vertex (+
// 1 for a closed fan), with negative areas, correct this overcount, so that a flat mesh acts like a plane [Li
// et al. 2023, convergent incremental potential contact]. If the nearby triangles form a connected region
// without a hole, the sum is at least what the nearest triangle alone gives, and grows without bound towards
// contact; a ring of faces around a point counts less.
//
// Areas: half of the vertex's area for a point and a triangle, since the vertices of the other side count too;
// for two edges a quarter of the smaller edge area, so that a coarse edge across many fine ones counts no more
// than the area it covers.
#pragma once

#include <optional>

#include "magshell/contact/face_boxes.h"
#include "magshell/contact/pair_energy.h"

namespace magshell {

/// Two surfaces in contact; one surface with itself if both are the same.
struct SurfacePair {
    Index a, b;
};

class BroadPhase {
  public:
    BroadPhase(std::vector<ContactSurface> surfaces, std::vector<SurfacePair> contacts);
    BroadPhase(BroadPhase&&) = default;
    BroadPhase(const BroadPhase&) = delete;  // the boxes refer to the surfaces

    /// Limits the activation distance plus minimum separation of neighbouring parts of a surface to half of
    /// their reference distance (ContactPair::room), if they are closer in the reference shape than
    /// `near_at_rest` (one per contact, [m]: twice activation distance plus minimum separation). Otherwise they
    /// would push each other in the reference shape. rest: reference positions of all nodes.
    void make_room(const std::vector<Vec3>& rest, const std::vector<double>& near_at_rest);

    /// Two neighbouring parts, and their reference distance [m].
    struct NeighbourPair {
        double distance;
        NearPair near;
    };
    /// Returns the closest neighbouring parts of a contact; empty if none are limited.
    const std::optional<NeighbourPair>& nearest_neighbours(Index contact) const { return nearest_[contact]; }

    const std::vector<ContactSurface>& surfaces() const { return surfaces_; }
    const std::vector<SurfacePair>& contacts() const { return contacts_; }

    /// Returns the pairs nearer than the `margins` of each contact [m] with nodes at q, and the overcount
    /// corrections. Pairs that share a node are left out, here and below.
    std::vector<NearPair> near(const double* q, const std::vector<double>& margins);
    /// Returns the pairs that may come closer than the margins while nodes move straight from q to `end`: all
    /// that do, and some whose boxes do.
    std::vector<NearPair> near_along_path(const double* q, const double* end,
                                          const std::vector<double>& margins);
    /// Returns the pairs of an edge (first) and a triangle (second) that intersect with nodes at q, by their
    /// faces: contact, first_face, second_face and swapped are set.
    std::vector<NearPair> crossings(const double* q);

    std::size_t bytes() const;

  private:
    /// Kinds of pairs, in the order of the results.
    enum class Sort { of_a_on_b, of_b_on_a, edges };
    /// The numbers of a vertex and a face, or of two edges, packed into one number by which they are sorted.
    using Key = std::uint64_t;
    struct Keys {
        std::vector<Key> of[3];
    };
    /// Distance limits of neighbouring parts, sorted by key.
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
