#!/usr/bin/env bash
# Tries wheels in bare containers, each a Linux with the wheel's Python and little else: `python -m magshell` and the README's
# first example have to pass there.
#
#     scripts/try_containers.sh dist/magshell-*.whl
#
# With docker or podman: in the image python:X.Y-slim. Otherwise, as root, in a Debian or Ubuntu release that has this Python, which
# debootstrap unpacks into a folder. What the wheels need is downloaded outside; containers have no network. PYTHON: whose pip
# downloads. A wheel that could not be tried is said, and the exit status is then 1.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
python=${PYTHON:-python3}
machine=$(uname -m)

say() { printf 'containers: %s\n' "$*"; }

work=$(mktemp -d)
trap 'umount -q "$work"/*/system/try "$work"/*/system/proc 2>/dev/null || true; rm -rf --one-file-system "$work"' EXIT

# The release that has a Python, its mirror and components, and a release that debootstrap unpacks alike, which it knows if it is old.
release_of() {
    case $1 in
        3.10) echo jammy http://archive.ubuntu.com/ubuntu main,universe gutsy ;;
        3.11) echo bookworm http://deb.debian.org/debian main sid ;;
        3.12) echo noble http://archive.ubuntu.com/ubuntu main,universe gutsy ;;
        3.13) echo trixie http://deb.debian.org/debian main sid ;;
        *) return 1 ;;
    esac
}

# Runs try.sh of a folder in a container with the Python.
in_container() {
    local version=$1 shared=$2 engine release mirror components like
    for engine in docker podman; do
        if command -v "$engine" >/dev/null && "$engine" info >/dev/null 2>&1; then
            say "$version: python:$version-slim, $engine"
            "$engine" pull --quiet "python:$version-slim"
            "$engine" run --rm --network none --volume "$shared:/try:ro" "python:$version-slim" sh /try/try.sh
            return
        fi
    done
    command -v debootstrap >/dev/null && [ "$(id -u)" -eq 0 ] || { say "neither docker, podman, nor debootstrap as root"; return 1; }
    read -r release mirror components like <<<"$(release_of "$version")" || { say "no release with Python $version is known"; return 1; }
    say "$version: $release from $mirror"
    mkdir "$shared/../system"
    debootstrap --variant=minbase --components="$components" --include=python3,python3-venv "$release" "$shared/../system" "$mirror" \
        "/usr/share/debootstrap/scripts/$like" >"$shared/../log" || { tail -n 3 "$shared/../log"; return 1; }
    mkdir "$shared/../system/try"
    mount --bind -o ro "$shared" "$shared/../system/try"
    mount -t proc proc "$shared/../system/proc"
    unshare --net chroot "$shared/../system" env -i PATH=/usr/bin:/bin HOME=/tmp sh /try/try.sh
}

failed=()
for wheel in "$@"; do
    version=$(basename "$wheel" | sed -E 's/.*-cp3([0-9]+)-.*/3.\1/')
    shared=$work/$version/shared
    mkdir -p "$shared/packages"
    awk '/^```python/ { inside = 1; next } /^```/ { if (inside) exit } inside' "$root/README.md" >"$shared/example.py"
    cat >"$shared/try.sh" <<'TRY'
set -e
python3 -m venv /tmp/environment
/tmp/environment/bin/pip install --quiet --no-index --find-links /try/packages 'magshell[plot]'
cd /tmp
/tmp/environment/bin/python -m magshell
/tmp/environment/bin/python /try/example.py
ls -l strip.png
TRY
    cp "$wheel" "$shared/packages/"
    tags=(--platform "linux_$machine" --platform "manylinux2014_$machine")
    for minor in $(seq 17 41); do tags+=(--platform "manylinux_2_${minor}_$machine"); done
    if "$python" -m pip download --quiet --only-binary=:all: --python-version "$version" --implementation cp "${tags[@]}" \
        --dest "$shared/packages" "${wheel}[plot]" && in_container "$version" "$shared"; then
        say "$version: passed"
    else
        failed+=("$(basename "$wheel")")
    fi
done
[ ${#failed[@]} -eq 0 ] || { say "not tried, or failed: ${failed[*]}"; exit 1; }
