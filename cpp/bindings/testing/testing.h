// Declares what is bound for tests and benchmarks only: single kernels, which scenes evaluate by whole terms.
// Compiled where MAGSHELL_TESTING is on.
#pragma once

#include "bindings/bindings.h"

namespace magshell::bindings {

void register_contact_pairs(py::module_& module);
void register_elimination_fronts(py::module_& module);
void register_kernels(py::module_& module);

}  // namespace magshell::bindings
