// Converts the description of muscles from Python.
#pragma once

#include "bindings/bindings.h"
#include "magshell/scene/scene_input.h"

namespace magshell::bindings {

std::vector<MuscleInput> muscles_of(const py::list& given);

}  // namespace magshell::bindings
