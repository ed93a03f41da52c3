// Creates the term of the energy of a film with a magnetic susceptibility, in a uniform applied flux density and any number of field
// sources. energy/induced_face.h
#pragma once

#include <memory>

#include "magshell/assembly/element_loop.h"
#include "magshell/body/surface.h"
#include "magshell/terms/magnetic/field_sources.h"
#include "magshell/terms/term.h"

namespace magshell {

/// Creates the term and registers "susceptibility" [1] and "thickness" [m] of every face. The loop and the sources must outlive it.
std::unique_ptr<Term> make_induced_term(const Surface& surface, Index body, const FaceLoop& loop,
                                        const FieldSources& sources, Registry& registry);

}  // namespace magshell
