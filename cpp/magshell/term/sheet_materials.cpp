#include "magshell/term/sheet_materials.h"

#include <algorithm>

namespace magshell {

SheetMaterials::SheetMaterials(const Surface& surface, Registry& registry)
    : thickness_(registry.values.add(surface.owner, "thickness", "m", surface.n_faces(), 1, &surface.faces)),
      young_modulus_(
          registry.values.add(surface.owner, "young_modulus", "Pa", surface.n_faces(), 1, &surface.faces)),
      poisson_ratio_(
          registry.values.add(surface.owner, "poisson_ratio", "1", surface.n_faces(), 1, &surface.faces)),
      of_faces_(surface.n_faces()) {}

bool SheetMaterials::set_values(const Values& values) {
    if (!values.changed(thickness_, young_modulus_, poisson_ratio_)) return false;
    for (Index f = 0; f < static_cast<Index>(of_faces_.size()); ++f)
        of_faces_[f] = {values.number(thickness_, f), values.number(young_modulus_, f),
                        values.number(poisson_ratio_, f)};
    return true;
}

double SheetMaterials::thinnest() const {
    double least = of_faces_.front().thickness;
    for (const SheetMaterial& material : of_faces_) least = std::min(least, material.thickness);
    return least;
}

}  // namespace magshell
