// Binds the energies of single faces: one line per energy.
#include "bindings/bindings.h"
#include "magshell/energy/surface_tension.h"
#include "magshell/terms/load/face_energy.h"

namespace magshell::bindings {
namespace {

template <class Kernel>
void face_energy(py::module_& module, const char* name) {
    py::class_<FaceEnergyOf<Kernel>, FaceEnergy, std::shared_ptr<FaceEnergyOf<Kernel>>>(module, name)
        .def(py::init<>());
}

}  // namespace

void register_face_energies(py::module_& module) {
    py::class_<FaceEnergy, std::shared_ptr<FaceEnergy>>(module, "FaceEnergy");
    face_energy<SurfaceTension>(module, "SurfaceTension");
}

}  // namespace magshell::bindings
