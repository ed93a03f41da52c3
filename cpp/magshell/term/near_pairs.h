// Which vertices and faces, and which edges, of surfaces are near each other.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "magshell/body/nodes.h"
#include "magshell/contact/pair_energy.h"

namespace magshell {

/// Triangles that touch others: of a body, or of a part of it.
struct ContactSurfaceInput {
    std::string name;                         // of the body
    std::vector<std::array<Index, 3>> faces;  // the caller's vertices
    std::vector<Index> numbers;               // of the faces in the body
};

/// Surfaces that touch each other; one and the same: itself.
struct BodyContactInput {
    Index a, b;
    bool penalty = false;               // else a barrier
    bool rubs = false, lagged = false;  // whether there is friction, and whether with the normal force of before
};

struct NearPair {
    Index contact;
    ContactPair pair;
    Index first_face, second_face;  // a face of each part, of the surfaces
    bool swapped;                   // whether the first part is of surface b

    bool operator==(const NearPair&) const = default;
};

class NearPairs {
  public:
    NearPairs(const Nodes& nodes, const std::vector<ContactSurfaceInput>& surfaces,
              const std::vector<BodyContactInput>& contacts);

    /// The distance within which each contact's pairs matter [m].
    void set_distances(std::vector<double> distances);
    /// Those that are nearer than that at q, and some more; always in the same order.
    const std::vector<NearPair>& at(const double* q) const;
    /// Those that may come nearer than that on the way from q to q + p.
    std::vector<NearPair> along(const double* q, const double* p) const;
    std::string names(const NearPair& pair) const;
    double margin() const { return margin_; }
    std::size_t bytes() const;

  private:
    struct Surface {
        std::string name;
        std::vector<Index> numbers;
        std::vector<std::array<Index, 3>> faces;
        std::vector<Index> vertices, vertex_faces;
        std::vector<double> vertex_areas;
        std::vector<std::array<Index, 2>> edges;
        std::vector<Index> edge_faces;
        std::vector<double> edge_areas, edge_lengths;
    };

    template <class Take>
    void each_pair(const Take& take) const;

    std::vector<Surface> surfaces_;
    std::vector<BodyContactInput> contacts_;
    std::vector<double> distances_;
    double margin_ = 0.0;
    mutable std::vector<NearPair> near_;
    mutable VectorXd built_at_;
};

}  // namespace magshell
