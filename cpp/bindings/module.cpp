// Defines the extension module: errors first, then one register function per family.
#include "bindings/bindings.h"

PYBIND11_MODULE(_core, module) {
    namespace b = magshell::bindings;
    module.doc() = "The C++ core of magshell; use the functions of the package, not this module.";
    module.attr("__version__") = MAGSHELL_VERSION;
    b::register_errors(module);
    b::register_linalg(module);
    b::register_mesh(module);
    b::register_field(module);
    b::register_obstacle(module);  // MeshObstacle takes a mesh
    b::register_water(module);
    b::register_face_energies(module);
    b::register_group_energy(module);
    b::register_model(module);
    b::register_sheet(module);
    b::register_body_contact(module);  // takes models
    b::register_muscle(module);
    b::register_solid(module);
    b::register_statics(module);
    b::register_adjoint(module);       // takes results of solves
    b::register_continuation(module);  // shares options with statics
    b::register_dynamics(module);
    b::register_picture(module);
#ifdef MAGSHELL_TESTING
    b::register_contact_pairs(module);
    b::register_elimination_fronts(module);
    b::register_shape_friction(module);
    b::register_kernels(module);
#endif
}
