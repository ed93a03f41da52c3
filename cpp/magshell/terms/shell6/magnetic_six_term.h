// Creates the term of the magnetic energy of a shell of quadratic triangles, whose field is sampled at six points of
// each. energy/magnetic_six.h
#pragma once

#include <memory>

#include "magshell/assembly/element_coloring.h"
#include "magshell/body/six_node_shell.h"
#include "magshell/energy/magnetization_law.h"
#include "magshell/terms/magnetic/field_sources.h"
#include "magshell/terms/term.h"

namespace magshell {

/// Creates the term and registers "remanent_magnetization" [A/m] and "thickness" [m] of every face. The sources must outlive it.
std::unique_ptr<Term> make_magnetic_six_term(MagnetizationLaw law, const SixNodeShell& shell, Index body,
                                             const ColoredLoop& element_blocks, const SystemMatrix& matrix,
                                             const FieldSources& sources, Registry& registry);

}  // namespace magshell
