#!/usr/bin/env bash
# Builds the wheel of the Python package into target/wheels, and tests it in an empty virtual environment. Arguments go to
# `maturin build`: `--zig` for a wheel that older systems load as well; `--zig --target aarch64-unknown-linux-gnu` for another processor, whose
# wheel is built and its tag and library are looked at, but not tested.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=scripts/cmake.sh
source scripts/cmake.sh

python="${PYTHON:-python3}"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
wheels="${FLEXBODY_WHEELS:-$PWD/target/wheels}"
processor="$(uname -m)"
[[ " $* " != *" --target aarch64"* ]] || processor=aarch64
rm -f "$wheels"/flexbody-*_"$processor".whl

# In a place that stays: the build of HDF5 remembers the compiler, which is a part of maturin with --zig.
build="$PWD/.tools/maturin"
"$python" -m venv "$build"
"$build/bin/pip" install --quiet --disable-pip-version-check 'maturin[zig]>=1.9,<2'
(cd python && PATH="$build/bin:$PATH" maturin build --release --locked --out "$wheels" "$@")
wheel="$(ls "$wheels"/flexbody-*_"$processor".whl)"
echo "wheel: $wheel, $(du -h "$wheel" | cut -f1)"
if [ "$processor" != "$(uname -m)" ]; then
    "$python" -m zipfile -e "$wheel" "$work/unpacked"
    machine="$(readelf --file-header "$work"/unpacked/flexbody/*.so | sed -n 's/^ *Machine: *//p')"
    [ "$machine" = AArch64 ] || { echo "error: the library is for $machine" >&2; exit 1; }
    echo "for $machine, not tested: this machine is another"
    exit 0
fi

"$python" -m venv "$work/empty"
"$work/empty/bin/pip" install --quiet --disable-pip-version-check 'numpy>=1.23'
seconds=$SECONDS
"$work/empty/bin/pip" install --quiet --disable-pip-version-check "$wheel"
echo "installed beside numpy in $((SECONDS - seconds)) s"
"$work/empty/bin/flexbody" --version
"$work/empty/bin/pip" install --quiet --disable-pip-version-check "$wheel[test]"
# Not in the folder of the sources: what is tested is what was installed.
"$work/empty/bin/python" -m pytest --quiet -p no:cacheprovider -c python/pyproject.toml --rootdir python "$PWD/python/tests"
