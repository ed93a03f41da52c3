// Converts the description of a scene from Python.
#pragma once

#include <vector>

#include "bindings/bindings.h"
#include "magshell/scene/scene_input.h"
#include "magshell/terms/load/group_energy_term.h"

namespace magshell::bindings {

SceneInput scene_input(const py::kwargs& given);

std::vector<GroupEnergyInput> group_energies_of(const py::list& given);

/// Converts the keys "surface" and "surface_vertices" of a body.
SolidSurface surface_of(const py::handle& given);
/// Converts the key "magnetization_rotates" of a body.
MagnetizationLaw magnetization_law_of(const py::handle& given);
std::vector<SolidInput> solids_of(const py::list& given);
std::vector<SkinInput> skins_of(const py::list& given);
/// Convert the volumes of cavities and pneumatic cells, tendons, springs, and creases.
std::vector<VolumeInput> volumes_of(const py::list& given);
std::vector<TendonInput> tendons_of(const py::list& given);
std::vector<SpringsInput> springs_of(const py::list& given);
std::vector<CreaseInput> creases_of(const py::list& given);

std::vector<MuscleInput> muscles_of(const py::list& given);

}  // namespace magshell::bindings
