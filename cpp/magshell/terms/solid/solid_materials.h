// The materials of solids: what a file terms/solid/solid_<file>.cpp defines, and from what its terms are made.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "magshell/terms/solid/solid_term.h"

namespace magshell {

/// Everything from which the term of a solid is made.
struct SolidTermInput {
    const SolidResponse& response;
    const Solid& solid;
    Index body;
    const ColoredLoop& element_blocks;
    const SystemMatrix& matrix;
    const Nodes& nodes;
    Registry& registry;
};

using MakeSolidTerm = std::unique_ptr<SolidTerm> (*)(const SolidTermInput&);

/// The materials of one file terms/solid/solid_<file>.cpp, which defines `SolidMaterials <file>_materials()`: by the
/// name that Python gives each, the function that creates its term. CMake lists the files.
using SolidMaterials = std::vector<std::pair<std::string, MakeSolidTerm>>;

}  // namespace magshell
