#!/usr/bin/env bash
# Builds the package with other options, in a directory of its own: build/NAME/site, to be put on PYTHONPATH.
#
#     scripts/build_aside.sh NAME [options of cmake]
#
# A second call compiles what has changed. $PYTHON is an interpreter with pybind11; JOBS: how many compilers run at a time.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
build=build/${1:?"the name of the directory below build"}
shift
python=$(command -v "${PYTHON:-python3}")
PATH=$(dirname "$python"):$PATH  # where pip puts cmake and ninja

mkdir -p build
if [ ! -f "$build/CMakeCache.txt" ]; then
    cmake -G Ninja -S . -B "$build" -DMAGSHELL_TESTING=ON -DPython_EXECUTABLE="$python" \
        -DSKBUILD_PROJECT_VERSION="$(sed -n 's/^version = "\(.*\)"$/\1/p' pyproject.toml)" \
        -Dpybind11_DIR="$("$python" -m pybind11 --cmakedir)" "$@" ${CMAKE_ARGS:-} >"$build.log" ||
        { cat "$build.log"; rm -f "$build/CMakeCache.txt"; exit 1; }
fi
"$python" scripts/build_progress.py "$build.log" cmake --build "$build" --parallel "${JOBS:-$(nproc)}"
rm -rf "$build/site"
mkdir "$build/site"
cp -r python/magshell "$build/site"
rm -f "$build"/site/magshell/_core*.so  # another build's, which the install would take for its own if it is as new
cmake --install "$build" --prefix "$build/site" >>"$build.log"
