#include "magshell/terms/shell/shell_materials.h"

#include <algorithm>

namespace magshell {

ShellMaterials::ShellMaterials(const std::string& owner, const Renumbering& faces, Registry& registry)
    : thickness_(registry.values.add(owner, "thickness", "m", faces.size(), 1, &faces)),
      young_modulus_(registry.values.add(owner, "young_modulus", "Pa", faces.size(), 1, &faces)),
      poisson_ratio_(registry.values.add(owner, "poisson_ratio", "1", faces.size(), 1, &faces)),
      of_faces_(faces.size()) {}

bool ShellMaterials::set_values(const Values& values) {
    if (!values.changed(thickness_, young_modulus_, poisson_ratio_)) return false;
    for (Index f = 0; f < static_cast<Index>(of_faces_.size()); ++f)
        of_faces_[f] = {values.number(thickness_, f), values.number(young_modulus_, f),
                        values.number(poisson_ratio_, f)};
    return true;
}

double ShellMaterials::thinnest() const {
    double least = of_faces_.front().thickness;
    for (const ShellMaterial& material : of_faces_) least = std::min(least, material.thickness);
    return least;
}

}  // namespace magshell
