// ShellMaterials: thickness, Young's modulus and Poisson's ratio of every face of a shell, and the gradients by
// them.
#pragma once

#include <vector>

#include "magshell/body/surface.h"
#include "magshell/core/parameters.h"
#include "magshell/energy/material.h"

namespace magshell {

class ShellMaterials {
  public:
    ShellMaterials(const Surface& surface, Registry& registry)
        : ShellMaterials(surface.owner, surface.faces, registry) {}
    /// Registers the parameters. `faces` must outlive the registry.
    ShellMaterials(const std::string& owner, const Renumbering& faces, Registry& registry);

    /// Reads the parameters; returns true if any has changed.
    bool set_values(const Values& values);
    const ShellMaterial& operator[](Index face) const { return of_faces_[face]; }
    double thinnest() const;
    std::size_t bytes() const { return of_faces_.capacity() * sizeof(ShellMaterial); }

    /// Adds the gradient of lambda . g by the material of a face, for an energy whose stiffness is proportional
    /// to this power of the thickness. work: lambda . g; by_poisson_ratio: lambda . dg/dnu.
    void add_vjp(Index face, int power, double work, double by_poisson_ratio, Gradient& out) const {
        out.values[young_modulus_.at(face)] += work / of_faces_[face].young_modulus;
        out.values[thickness_.at(face)] += power * work / of_faces_[face].thickness;
        out.values[poisson_ratio_.at(face)] += by_poisson_ratio;
    }

  private:
    ParameterSlice thickness_, young_modulus_, poisson_ratio_;
    std::vector<ShellMaterial> of_faces_;
};

}  // namespace magshell
