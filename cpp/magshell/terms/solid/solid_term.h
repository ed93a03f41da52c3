// SolidTerm: the elastic energy of a solid, for all kinds of elements and materials. terms/solid/tetrahedra_term.h
// implements it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "magshell/body/solid.h"
#include "magshell/terms/shell/elastic_term.h"

namespace magshell {

/// The state of a solid at each integration point, element by element in the caller's order.
struct PointStates {
    int points = 1;                           // per element
    std::vector<Mat3> deformation_gradients;  // F
    std::vector<Mat3> cauchy_stresses;        // P F^T / J [Pa]
    std::vector<double> volumes;              // reference volumes [m3]
};

class SolidTerm : public ElasticTerm, public StressRateTerm {
  public:
    std::string_view name() const final { return "solid"; }
    /// Returns deformation gradients and elastic stresses at q, without viscous stresses.
    virtual PointStates point_states(const double* q) const = 0;
};

/// The material law of a solid.
struct SolidResponse {
    std::string material;      // a name of the solid_*.cpp files, such as "NeoHookean ln J"
    bool mean_volume = false;  // evaluate the volumetric energy at the mean volume change of each element
};

/// Creates the term. Throws InvalidInput if the material or the kind of element does not exist.
std::unique_ptr<SolidTerm> make_solid_term(const SolidResponse& response, const Solid& solid, Index body,
                                           const ColoredLoop& element_blocks, const SystemMatrix& matrix,
                                           const Nodes& nodes, Registry& registry);

}  // namespace magshell
