#!/usr/bin/env bash
# Wheels for every Python that pyproject.toml claims, each made and tried by scripts/wheel.sh in an environment of its own.
#
#     scripts/wheels.sh [python3.10 /opt/python/cp312-cp312/bin/python ...]
#
# The core is compiled once for all of them. Without names: pythonX.Y of every claimed version that is on the path. All wheels
# and the sdist end in dist/. A claimed version without an interpreter is said, and the exit status is then 1: a release holds
# all of them. Other machines (aarch64, macOS) are what .github/workflows/wheels.yml is for.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

say() { printf 'wheels: %s\n' "$*"; }

mapfile -t claimed < <(grep -oE 'Python :: 3\.[0-9]+' pyproject.toml | grep -oE '3\.[0-9]+')
pythons=("$@")
if [ ${#pythons[@]} -eq 0 ]; then
    for version in "${claimed[@]}"; do
        ! command -v "python$version" >/dev/null || pythons+=("python$version")
    done
fi
[ ${#pythons[@]} -gt 0 ] || { say "there is no interpreter of ${claimed[*]}"; exit 1; }

rm -rf build/wheels-of-all && mkdir -p build/wheels-of-all
made=()
for python in "${pythons[@]}"; do
    version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    say "$version: $("$python" -c 'import sys; print(sys.executable)')"
    environment=$(mktemp -d)
    "$python" -m venv "$environment"
    AGAIN=${made:+1} PYTHON=$environment/bin/python scripts/wheel.sh
    rm -rf "$environment"
    cp dist/*.whl dist/*.tar.gz build/wheels-of-all/
    made+=("$version")
done
rm -rf dist build/wheel && mv build/wheels-of-all dist
ls -l dist

lacking=()
for version in "${claimed[@]}"; do
    [[ " ${made[*]} " == *" $version "* ]] || lacking+=("$version")
done
[ ${#lacking[@]} -eq 0 ] || { say "made for ${made[*]}; claimed too, but not made: ${lacking[*]}"; exit 1; }
say "made for ${made[*]}"
