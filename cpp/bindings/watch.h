// Watch: checks for Ctrl-C and reports progress to Python from inside a long solve, a few times a second.
#pragma once

#include <chrono>

#include "bindings/call_python.h"

namespace magshell::bindings {

class Watch {
  public:
    explicit Watch(py::object progress) : progress_(std::move(progress)) {}

    /// Call without the GIL. Throws Interrupted on Ctrl-C; exceptions of the progress function are passed on.
    void operator()(double progress, double residual) const {
        const Clock::time_point now = Clock::now();
        if (now - last_ < std::chrono::milliseconds(50)) return;
        last_ = now;
        const py::gil_scoped_acquire locked;
        if (PyErr_CheckSignals() != 0) {
            if (!PyErr_ExceptionMatches(PyExc_KeyboardInterrupt)) throw py::error_already_set();
            PyErr_Clear();
            throw Interrupted();
        }
        if (!progress_.is_none()) call_python(progress_, progress, residual);
    }

  private:
    using Clock = std::chrono::steady_clock;
    py::object progress_;
    mutable Clock::time_point last_{};
};

}  // namespace magshell::bindings
