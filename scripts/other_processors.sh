#!/usr/bin/env bash
# Runs tests as other processors see them: with the instructions that their libraries would take, and with the extension
# compiled for their family.
#
#     scripts/other_processors.sh [nehalem|haswell|zen|skylakex|x86-64-v2|x86-64-v3 ...] [-- arguments of pytest]
#
# Without names: the last three, which hold the others. nehalem, haswell, zen and skylakex are settings of numpy's, scipy's and
# torch's linear algebra (OpenBLAS, MKL), of numpy's and torch's own loops and of the C library's functions; what this processor
# lacks is left out, and said. For zen the OpenBLAS of numpy and scipy takes Haswell's kernels (numpy 2.4, scipy 1.17: the same
# bits). x86-64-v2 and v3 compile the extension, in a directory each, and run it on the libraries of nehalem and haswell. Without
# arguments of pytest: the tests of `make test`. $PYTHON is an interpreter with what the tests need. Every failure is a test, or
# code, that hangs on how numbers were rounded.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
python=$(command -v "${PYTHON:-python3}")

known=(nehalem haswell zen skylakex x86-64-v2 x86-64-v3)
chosen=()
while [ $# -gt 0 ] && [ "$1" != -- ]; do
    [[ " ${known[*]} " == *" $1 "* ]] || { echo "unknown processor: $1 (known: ${known[*]})" >&2; exit 2; }
    chosen+=("$1")
    shift
done
[ $# -eq 0 ] || shift
arguments=("$@")
[ ${#arguments[@]} -gt 0 ] || arguments=(-m "not nightly")
[ ${#chosen[@]} -gt 0 ] || chosen=(skylakex x86-64-v2 x86-64-v3)
[ "$(uname -m)" = x86_64 ] || { echo "these are x86-64 processors; this one is a $(uname -m)" >&2; exit 2; }

# numpy's names of what it chooses at run time, without those that match a pattern.
numpy_without() {
    "$python" -c 'import re, sys
try:
    from numpy._core import _multiarray_umath as core
except ImportError:  # numpy 1
    from numpy.core import _multiarray_umath as core
print(*(name for name in core.__cpu_dispatch__ if re.search(sys.argv[1], name)))' "$1"
}

sse() {
    export ATEN_CPU_CAPABILITY=default MKL_CBWR=COMPATIBLE GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F
    export OPENBLAS_CORETYPE=Nehalem NPY_DISABLE_CPU_FEATURES
    NPY_DISABLE_CPU_FEATURES=$(numpy_without 'AVX|FMA|V3|V4')
}
avx2() {
    export ATEN_CPU_CAPABILITY=avx2 MKL_CBWR=AVX2 GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX512F
    export OPENBLAS_CORETYPE=$1 NPY_DISABLE_CPU_FEATURES
    NPY_DISABLE_CPU_FEATURES=$(numpy_without 'AVX512|V4')
}

# The package with the extension compiled for a family, before any other.
compiled_for() {
    PYTHON=$python scripts/build_aside.sh "$1" -DMAGSHELL_NATIVE=OFF -DMAGSHELL_BASELINE="$1" || return 1
    export PYTHONPATH=$PWD/build/$1/site${PYTHONPATH:+:$PYTHONPATH}
}

as_processor() {
    case $1 in
        nehalem) sse ;;
        haswell) avx2 Haswell ;;
        zen) avx2 Zen ;;
        skylakex)
            grep -qw avx512f /proc/cpuinfo || { echo "skylakex: left out, as this processor has no AVX-512"; return 0; }
            export OPENBLAS_CORETYPE=SkylakeX
            ;;
        x86-64-v2) compiled_for "$1" && sse || return 1 ;;
        x86-64-v3) compiled_for "$1" && avx2 Haswell && export MAGSHELL_VECTORS=baseline || return 1 ;;
    esac
    "$python" -m pytest -q -p no:cacheprovider -n "${PROCESSES:-auto}" --dist loadfile --no-loadscope-reorder \
        "${arguments[@]}"
}

failed=()
for processor in "${chosen[@]}"; do
    echo "== as $processor"
    (as_processor "$processor") || failed+=("$processor")
done
[ ${#failed[@]} -eq 0 ] || { echo "failed as: ${failed[*]}"; exit 1; }
echo "as ${chosen[*]}: passed"
