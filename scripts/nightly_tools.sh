#!/usr/bin/env bash
# Installs what tests are skipped without, beside the extra `test`, and names what could not be installed.
#
#     PYTHON=.venv/bin/python scripts/nightly_tools.sh
#
# Packages of Debian or Ubuntu, where root or sudo allows it, and NGSolve into the environment of $PYTHON. What is there already
# is left alone. The exit status is 0 in either case: the tests that need what is missing are skipped, and say so.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
python=${PYTHON:-.venv/bin/python}

say() { printf 'nightly: %s\n' "$*"; }
found() { command -v "$1" >/dev/null; }
has_browser() { found chromium || found chromium-browser || found google-chrome || found chrome; }
has_calculix() { found ccx; }
has_cholmod() { echo '#include <cholmod.h>' | "${CXX:-c++}" -I/usr/include/suitesparse -fsyntax-only -x c++ - 2>/dev/null; }
has_ngsolve() { "$python" -c 'import ngsolve' 2>/dev/null; }

as_root=()
[ "$(id -u)" -eq 0 ] || as_root=(sudo -n)
updated=
package() {  # one after another, as one that the distribution lacks must not keep the others from being installed
    found apt-get || return 0
    if [ -z "$updated" ]; then
        updated=yes
        "${as_root[@]}" apt-get update -q >/dev/null 2>&1 || true
    fi
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends "$@" >/dev/null 2>&1 || true
}

missing=()
has_browser || package chromium
has_browser || missing+=("a Chromium: live views in a browser (tests/output/live)")
has_calculix || package calculix-ccx
has_calculix || missing+=("CalculiX (ccx)")
has_cholmod || package libsuitesparse-dev libopenblas-dev
has_cholmod || missing+=("CHOLMOD: the factorization and ordering to compare with (scripts/cholmod.sh)")
has_ngsolve || "$python" -m pip --disable-pip-version-check install --quiet -r <("$python" scripts/requirements.py ngsolve) || true
has_ngsolve || missing+=("NGSolve: shells to compare with (tests/physics/test_against_ngsolve.py)")
for each in ${missing[@]+"${missing[@]}"}; do say "not installed: $each"; done
[ ${#missing[@]} -gt 0 ] || say "a browser, CalculiX, CHOLMOD and NGSolve are there"
