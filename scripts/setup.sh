#!/usr/bin/env bash
# Installs the system packages that magshell builds and draws with, where root or sudo allows it.
#
#     scripts/setup.sh [python]          the interpreter to build for, python3 by default
#
# What is there already is left alone. What cannot be installed is named, and the script goes on: the GL libraries are
# optional. Only a missing interpreter, venv module or compiler ends it with an error.
set -euo pipefail

python=${1:-python3}
optional=(
    libegl1 libgl1 libgl1-mesa-dri libglu1-mesa             # off-screen pictures
    libxrender1 libxcursor1 libxft2 libxinerama1            # what the gmsh wheel links against
)

say() { printf 'setup: %s\n' "$*"; }
installed() { [ "$(dpkg-query -W -f '${db:Status-Status}' "$1" 2>/dev/null)" = installed ]; }
compiler_works() { command -v "${CXX:-c++}" >/dev/null; }
python_works() { command -v "$python" >/dev/null; }
python_recent() { "$python" -c 'import sys; sys.exit(sys.version_info < (3, 10))'; }
venv_works() { "$python" -c 'import ensurepip, venv' 2>/dev/null; }
headers_work() {
    "$python" -c 'import os, sys, sysconfig
sys.exit(not os.path.exists(os.path.join(sysconfig.get_path("include"), "Python.h")))'
}

# The packages this machine still needs, one a line.
missing() {
    local package prefix
    if python_works; then  # python3.12-venv for an interpreter that is not the distribution's default one
        prefix=$("$python" -c 'import sys; print("python%d.%d" % sys.version_info[:2])')
        venv_works || echo "$prefix-venv"
        headers_work || echo "$prefix-dev"
    elif [ "$python" = python3 ]; then
        printf '%s\n' python3 python3-venv python3-dev
    fi
    compiler_works || echo build-essential
    for package in libeigen3-dev "${optional[@]}"; do
        installed "$package" || echo "$package"
    done
}

# How to become root: directly, through a sudo that asks nothing, or through one that can ask somebody.
root_prefix() {
    if [ "$(id -u)" -eq 0 ]; then
        echo env
    elif command -v sudo >/dev/null && { sudo -n true 2>/dev/null || { [ -t 0 ] && [ -z "${CI:-}" ]; }; }; then
        echo sudo env
    else
        return 1
    fi
}

install_packages() {
    $as_root DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "$@"
}

if python_works && ! python_recent; then
    say "$python is $("$python" -V); magshell needs Python 3.10 or later (PYTHON=... make)"
    exit 1
fi
if command -v dpkg-query >/dev/null && command -v apt-get >/dev/null; then
    mapfile -t packages < <(missing)
    if [ "${#packages[@]}" -gt 0 ] && as_root=$(root_prefix); then
        say "installing ${packages[*]}"
        $as_root apt-get update -q || say "apt-get update did not work; trying with the lists that are there"
        # One package that the distribution does not have must not keep the others from being installed.
        install_packages "${packages[@]}" || for package in "${packages[@]}"; do
            install_packages "$package" || true
        done
        mapfile -t packages < <(missing)
    fi
    [ "${#packages[@]}" -eq 0 ] || say "missing; as root: apt-get install ${packages[*]}"
else
    say "not a Debian-like system: a C++20 compiler, Python's headers and Eigen 3.4 must be there;" \
        "GL is used where it is"
fi

python_works || { say "there is no $python"; exit 1; }
venv_works || { say "$python has no venv module"; exit 1; }
compiler_works || { say "there is no C++ compiler"; exit 1; }
