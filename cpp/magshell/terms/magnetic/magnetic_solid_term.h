// Creates the term of a magnetized solid's Zeeman energy.
// energy/magnetic_solid.h
#pragma once

#include <memory>

#include "magshell/body/solid.h"
#include "magshell/energy/magnetization_law.h"
#include "magshell/terms/magnetic/field_sources.h"
#include "magshell/terms/term.h"

namespace magshell {

/// Creates the term and registers "remanent_magnetization" [A/m], one vector per element. The sources must
/// outlive it.
std::unique_ptr<Term> make_magnetic_solid_term(MagnetizationLaw law, const Solid& solid, Index body,
                                               const ColoredLoop& element_blocks, const SystemMatrix& matrix,
                                               const FieldSources& sources, Registry& registry);

}  // namespace magshell
