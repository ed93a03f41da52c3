// Creates the term of the magnetic energy of a shell of linear triangles, or of a skin, in a uniform applied flux
// density and any number of field sources. energy/magnetic_face.h
#pragma once

#include <memory>

#include "magshell/assembly/element_loop.h"
#include "magshell/body/surface.h"
#include "magshell/energy/magnetization_law.h"
#include "magshell/terms/magnetic/field_sources.h"
#include "magshell/terms/term.h"

namespace magshell {

/// Creates the term and registers "remanent_magnetization" [A/m] and "thickness" [m] of every face. The loop and the sources must outlive it.
std::unique_ptr<Term> make_magnetic_term(MagnetizationLaw law, const Surface& surface, Index body,
                                         const FaceLoop& loop, const FieldSources& sources,
                                         Registry& registry);

}  // namespace magshell
