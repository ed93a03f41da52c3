// Converts the description of energies of groups of vertices from Python, and binds the energy that calls Python.
#pragma once

#include <vector>

#include "bindings/bindings.h"
#include "magshell/terms/load/group_energy_term.h"

namespace magshell::bindings {

std::vector<GroupEnergyInput> group_energies_of(const py::list& given);

void register_group_energy(py::module_& module);

}  // namespace magshell::bindings
