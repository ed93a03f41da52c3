// The gradient of a scene's energies by rest positions, through the shape that bodies have at rest. What supports prescribe at rest, masses
// and loads per length or area follow X besides: the caller adds these.
//
// A homogeneous deformation I + H of the rest shape at a point of an element, H = sum_k dX_k (x) g_k with the gradients g_k of the shape
// functions, changes lambda . g by B : H, so that d(lambda . g)/dX_k = sum over points B g_k (terms/solid/tetrahedra.h,
// energy/rest_corners.h).
#pragma once

#include <string_view>
#include <vector>

#include "magshell/scene/model.h"

namespace magshell {

/// Adds lambda . dg/dX at the last evaluated state q, three numbers per node: of rest positions of vertices and of directions. The last
/// ModelParameters::vjp() had the same arguments.
void add_rest_vjp(Model& model, const VectorXd& q, const LoadParameters& load_parameters,
                  const VectorXd& lambda, VectorXd& out);

/// Adds - lambda . df/dX of the forces that have no energy at the last evaluated state.
void add_rest_forces_vjp(const Model& model, const VectorXd& lambda, VectorXd& out);

/// Adds s . dd/dX of the strains d of all elastic terms at the last evaluated state.
void add_rest_strains_vjp(const ViscousTerms& terms, const StrainSet& stresses, VectorXd& out);

/// Returns the names of the energies and forces that have no derivative with respect to rest positions, which add_rest_vjp() would leave
/// out.
std::vector<std::string_view> without_rest_gradient(const Model& model);

}  // namespace magshell
