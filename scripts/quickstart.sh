#!/usr/bin/env bash
# Builds flexbody and turns the connecting rod of fixtures/ into a flexible body, with a report.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

if ! command -v cargo >/dev/null; then
    echo "error: cargo is not on the PATH" >&2
    echo "  help: install Rust 1.89 or newer, see https://rustup.rs" >&2
    exit 1
fi

# HDF5 of the system, where there is one of version 1.10 or newer, spares the longest C build.
if command -v pkg-config >/dev/null && pkg-config --atleast-version=1.10 hdf5; then
    echo "HDF5: version $(pkg-config --modversion hdf5) of the system"
    build=(--release --locked --package flexbody --no-default-features --features parts)
else
    echo "HDF5: built in, since pkg-config knows none of version 1.10 or newer"
    build=(--release --locked --package flexbody)
    # shellcheck source=scripts/cmake.sh
    source scripts/cmake.sh
fi

# Prints a line a minute while cargo builds: its own bar is for terminals only.
tell_progress() {
    local log="$1" all minutes=0
    all="$(cargo tree "${build[@]:1}" --edges normal,build --prefix none 2>/dev/null | cut -d' ' -f1,2 | sort -u | wc -l)"
    # Without the output of this script, which a pipe would otherwise wait for until the last minute is over.
    while sleep 60 >/dev/null 2>&1; do
        minutes=$((minutes + 1))
        echo "building since $minutes min: $(grep -c '^ *Compiling ' "$log") of some $all packages begun, the largest come last"
    done
}

echo "building the program: 12 to 20 minutes of one processor the first time, half of that on two"
if [ -t 2 ]; then
    cargo build "${build[@]}"
else
    log="$(mktemp)"
    tell_progress "$log" &
    teller=$!
    trap 'kill "$teller" 2>/dev/null || true; rm -f "$log"' EXIT
    cargo build "${build[@]}" 2> >(tee "$log" >&2)
    kill "$teller"
fi
mkdir -p target/quickstart
cargo run --quiet "${build[@]}" -- convert fixtures/models/connecting_rod/model.toml \
    -o target/quickstart/connecting_rod.flex.h5 --report target/quickstart/connecting_rod.html

echo
echo "flexible body: target/quickstart/connecting_rod.flex.h5"
echo "report:        target/quickstart/connecting_rod.html"
echo
echo 'next: export PATH="$PWD/target/release:$PATH", then docs/start/tour.md'
