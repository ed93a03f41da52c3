// Converts the description of a scene from Python.
#pragma once

#include "bindings/bindings.h"
#include "magshell/scene/scene_input.h"

namespace magshell::bindings {

SceneInput scene_input(const py::kwargs& given);

}  // namespace magshell::bindings
