# shellcheck shell=bash
# Sourced, not run: makes sure that CMake 3.26 or newer is found, which building HDF5 needs. Older than that (as on Debian 12), or
# none: PyPI's CMake goes into .tools/ of this folder. Leaves the options of the calling shell alone.

flexbody_cmake_version="4.4.4"
flexbody_tools="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)/.tools"

flexbody_cmake_is_recent() {
    local version major minor
    version="$("$1" --version 2>/dev/null | sed -n 's/^cmake version \([0-9]*\.[0-9]*\).*/\1/p')"
    [ -n "$version" ] || return 1
    major="${version%%.*}"
    minor="${version##*.}"
    [ "$major" -gt 3 ] || { [ "$major" -eq 3 ] && [ "$minor" -ge 26 ]; }
}

flexbody_cmake_install() {
    local wanted="cmake==$flexbody_cmake_version"
    if ! command -v python3 >/dev/null; then
        echo "error: CMake 3.26 or newer is needed to build HDF5, and there is no python3 to install one." >&2
        echo "  help: install a recent cmake and put it on the PATH, or set CMAKE to it" >&2
        return 1
    fi
    echo "installing $wanted from PyPI into .tools/ (needed once, to build HDF5)" >&2
    mkdir -p "$flexbody_tools"
    # Not every python3 can make a venv (Debian splits ensurepip off); every pip knows --target.
    if python3 -m venv "$flexbody_tools/venv" >/dev/null 2>&1 &&
        "$flexbody_tools/venv/bin/python" -m pip install --quiet --disable-pip-version-check "$wanted" >&2; then
        return 0
    fi
    rm -rf "$flexbody_tools/venv"
    if python3 -m pip install --quiet --disable-pip-version-check --upgrade --target "$flexbody_tools/site" "$wanted" >&2; then
        return 0
    fi
    echo "error: CMake 3.26 or newer is needed to build HDF5, and pip could not install one." >&2
    echo "  help: install a recent cmake and put it on the PATH, or set CMAKE to it" >&2
    return 1
}

# Sets CMAKE to an installed one, if there is one.
flexbody_cmake_use_installed() {
    local program
    for program in "$flexbody_tools/venv/bin/cmake" "$flexbody_tools/site/cmake/data/bin/cmake"; do
        if flexbody_cmake_is_recent "$program"; then
            export CMAKE="$program"
            return 0
        fi
    done
    return 1
}

flexbody_cmake_find() {
    if [ -n "${CMAKE:-}" ] && flexbody_cmake_is_recent "$CMAKE"; then
        return 0
    fi
    # CMAKE stays unset: builds with and without these scripts are then the same to cargo, and HDF5 is built once.
    unset CMAKE
    if flexbody_cmake_is_recent cmake || flexbody_cmake_use_installed; then
        return 0
    fi
    flexbody_cmake_install || return 1
    flexbody_cmake_use_installed && return 0
    echo "error: the CMake that was installed into .tools/ does not run." >&2
    echo "  help: remove .tools/, install a recent cmake and put it on the PATH, or set CMAKE to it" >&2
    return 1
}

flexbody_cmake_find
