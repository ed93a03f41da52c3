// Binds the C++ exceptions to those of the Python package.
#include "magshell/core/errors.h"

#include "bindings/bindings.h"

namespace magshell::bindings {

void register_errors(py::module_&) {
    py::register_exception_translator([](std::exception_ptr error) {
        try {
            if (error) std::rethrow_exception(error);
        } catch (const InvalidInput& e) {
            PyErr_SetString(PyExc_ValueError, e.what());
        } catch (const Interrupted&) {
            PyErr_SetNone(PyExc_KeyboardInterrupt);
        }
    });
}

}  // namespace magshell::bindings
