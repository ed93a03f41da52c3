// A scene's description from Python, as Scene in the package hands it over.
#pragma once

#include "bindings/bindings.h"
#include "magshell/scene/scene_input.h"

namespace magshell::bindings {

SceneInput scene_input(const py::kwargs& given);

}  // namespace magshell::bindings
