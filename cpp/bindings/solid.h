// Solids from Python, as the scene hands them over.
#pragma once

#include "bindings/bindings.h"
#include "magshell/scene/scene_input.h"

namespace magshell::bindings {

/// The keys "surface" and "surface_vertices" of a body.
SolidSurface surface_of(const py::handle& given);
std::vector<SolidInput> solids_of(const py::list& given);
std::vector<SkinInput> skins_of(const py::list& given);
/// Volumes of cavities and cells, and tendons.
std::vector<VolumeInput> volumes_of(const py::list& given);
std::vector<TendonInput> tendons_of(const py::list& given);

}  // namespace magshell::bindings
