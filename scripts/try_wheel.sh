#!/usr/bin/env bash
# Tries a wheel in a bare environment: no compiler in reach, nothing of this folder on its path. `python -m magshell`, the
# README's quick start and the core tests have to pass.
#
#     PYTHON=.venv/bin/python scripts/try_wheel.sh dist/magshell-*.whl
set -euo pipefail
wheel=$(realpath "$1")
cd "$(dirname "${BASH_SOURCE[0]}")/.."
bare=$(mktemp -d)
trap 'rm -rf "$bare"' EXIT

"${PYTHON:-python3}" -m venv "$bare/venv"
torch=$(grep -o '"torch==[0-9.]*"' pyproject.toml | tr -d '"')  # the release that `make test` takes, its CPU build if there
"$bare/venv/bin/pip" install --quiet "${wheel}[plot]" "$torch" pytest
mkdir "$bare/tests" && cp README.md "$bare/" && cp -r docs "$bare/"  # the README's links lead there
cp {CONTRIBUTING,SECURITY}.md CITATION.cff LICENSE "$bare/"
cp -r tests/conftest.py tests/support "$bare/tests/"
mkdir -p "$bare/tests/docs" && cp tests/docs/test_readme.py "$_"
mkdir -p "$bare/tests/solve/statics" && cp tests/solve/statics/test_statics.py "$_"
mkdir -p "$bare/tests/solve/dynamics" && cp tests/solve/dynamics/test_dynamics.py "$_"
cd "$bare"
in_it() {
    env -i PATH="$bare/venv/bin" HOME="$bare" CXX=none MAGSHELL_NUM_THREADS=1 \
        ${vectors:+MAGSHELL_VECTORS="$vectors"} "$bare/venv/bin/python" "$@"
}
in_it -m magshell
in_it -m pytest -q -p no:cacheprovider -o pythonpath=tests/support tests
vectors=baseline  # what any processor of the family runs, where this one would take more
in_it -m magshell >"$bare/plain"
grep -q "vector instructions: [A-Z0-9]*$" "$bare/plain"
in_it -m pytest -q -p no:cacheprovider -o pythonpath=tests/support tests/solve/statics/test_statics.py
