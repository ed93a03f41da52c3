#!/usr/bin/env bash
# Runs the tests of linear algebra with CHOLMOD and METIS beside our own factorization and ordering.
#
#     scripts/cholmod.sh [arguments of pytest]
#
# Builds in build/cholmod, without optimization, as it takes a third of the time then. A binary with CHOLMOD is under the GPL.
# $PYTHON is an interpreter with what the tests need. Without CHOLMOD (Debian: libsuitesparse-dev) CMake says so and it ends.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
python=$(command -v "${PYTHON:-python3}")
[ $# -gt 0 ] || set -- tests/core/test_linalg.py tests/core/test_linalg_input.py tests/core/test_ordering.py
PYTHON=$python scripts/build_aside.sh cholmod -DMAGSHELL_CHOLMOD=ON -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS="-O0 -DNDEBUG"
export PYTHONPATH=$PWD/build/cholmod/site${PYTHONPATH:+:$PYTHONPATH}
exec "$python" -m pytest -q -p no:cacheprovider "$@"
