// The elastic energy of a solid, whatever its elements and its material; term/tetrahedra_term.h has them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "magshell/body/solid.h"
#include "magshell/term/elastic_term.h"

namespace magshell {

/// At each point of integration of each element, one element after another in the caller's order.
struct PointStates {
    int points = 1;                           // an element
    std::vector<Mat3> deformation_gradients;  // F
    std::vector<Mat3> cauchy_stresses;        // P F^T / J [Pa]
    std::vector<double> volumes;              // at rest [m3]
};

class SolidTerm : public ElasticTerm {
  public:
    std::string_view name() const final { return "solid"; }
    /// Of the elastic stress, without viscosity.
    virtual PointStates point_states(const double* q) const = 0;
};

/// How the elements of a solid respond.
struct SolidResponse {
    std::string material;      // "neo-Hookean ln J", ...: the names in term/solid_term.cpp
    bool mean_volume = false;  // the volumetric chunk on the mean over each element
};

/// Throws InvalidInput where there is no such material, or no such element.
std::unique_ptr<SolidTerm> make_solid_term(const SolidResponse& response, const Solid& solid, Index body,
                                           const ChunkLoop& chunks, const SystemMatrix& matrix,
                                           const Nodes& nodes, Registry& registry);

}  // namespace magshell
