#!/usr/bin/env bash
# Builds the extension with sanitizers in it, in a directory of its own, and runs tests against it.
#
#     scripts/sanitize.sh address,undefined|thread [arguments of pytest]
#
# Without arguments: a few minutes' choice of tests. The first report ends the run and fails it. $PYTHON is an
# interpreter with pybind11 and what the tests need; GCC's sanitizers, as its libraries are loaded before Python.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

sanitizers=${1:?"which: address,undefined or thread"}
shift
python=$(command -v "${PYTHON:-python3}")
build=build/sanitize-${sanitizers%%,*}
PYTHON=$python JOBS=2 scripts/build_aside.sh "$(basename "$build")" -DMAGSHELL_SANITIZE="$sanitizers"

declare -A library=([address]=libasan.so [undefined]=libubsan.so [thread]=libtsan.so)
path_of() { "${CXX:-c++}" -print-file-name="$1"; }
preload=
for name in ${sanitizers//,/ }; do preload+="$(path_of "${library[$name]}") "; done
run=()
if [ "$sanitizers" = thread ]; then  # it wants its part of the address space where it was compiled to be
    setarch "$(uname -m)" -R true 2>/dev/null && run=(setarch "$(uname -m)" -R)
    [ $# -gt 0 ] || set -- tests/hard/test_concurrency.py \
        tests/runtime/test_threads.py tests/core/test_linalg.py tests/core/test_invariance.py \
        tests/gradients/test_adjoint.py tests/solve/statics/test_statics.py \
        tests/solve/dynamics/test_dynamics.py tests/model/loads/test_surroundings_invariance.py \
        tests/core/test_solid_core.py tests/model/solids/test_skins.py tests/model/bodies/test_ties.py \
        tests/model/rigid/test_rigid_parts.py \
        -k "thread or same_time"
else
    [ $# -gt 0 ] || set -- tests/core/test_linalg.py tests/core/test_derivatives.py tests/model/fields/test_field.py \
        tests/mesh/test_mesh.py tests/input/test_bad_input.py tests/solve/statics/test_statics.py \
        tests/solve/dynamics/test_dynamics.py \
        tests/model/contact/test_obstacles.py tests/model/contact/test_contact.py \
        tests/model/contact/test_friction.py tests/core/test_water_kernel.py \
        tests/model/loads/test_water_motion.py tests/gradients/test_surroundings_adjoint.py \
        tests/core/test_lane_functions.py tests/core/test_solid_kernels.py tests/core/test_solid_core.py \
        tests/model/solids/test_solids.py tests/model/solids/test_skins.py tests/physics/test_skin_cases.py \
        tests/model/bodies/test_ties.py tests/model/rigid/test_rigid_parts.py tests/mesh/test_weld.py
fi

# Fresh memory is full of NaN, so that a number read before it is written spoils a result. Leaks are not looked for:
# Python ends with its own. The C++ library comes first because the sanitizers look for its throw in what is loaded.
export LD_PRELOAD="$preload$(path_of libstdc++.so)"
export ASAN_OPTIONS=detect_leaks=0:halt_on_error=1:max_malloc_fill_size=2147483647:malloc_fill_byte=255
export UBSAN_OPTIONS=print_stacktrace=1:halt_on_error=1
export TSAN_OPTIONS=halt_on_error=1:second_deadlock_stack=1
export PYTHONPATH="$PWD/$build/site" OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MAGSHELL_NUM_THREADS=2
exec "${run[@]}" "$python" -m pytest -p no:cacheprovider --capture=sys "$@"
