// The magnetic energy of a solid that is magnetized throughout.                              energy/magnetic_solid.h
#pragma once

#include <memory>

#include "magshell/body/solid.h"
#include "magshell/term/field_sources.h"
#include "magshell/term/term.h"

namespace magshell {

/// Registers "remanent_magnetization" of the solid, one an element. The sources have to outlive it.
std::unique_ptr<Term> make_magnetic_solid_term(const Solid& solid, Index body, const ChunkLoop& chunks,
                                               const SystemMatrix& matrix, const FieldSources& sources,
                                               Registry& registry);

}  // namespace magshell
