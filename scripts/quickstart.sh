#!/usr/bin/env bash
# Builds flexbody and turns the connecting rod of fixtures/ into a flexible body, with a report.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

if ! command -v cargo >/dev/null; then
    echo "error: cargo is not on the PATH" >&2
    echo "  help: install Rust 1.89 or newer, see https://rustup.rs" >&2
    exit 1
fi
# shellcheck source=scripts/cmake.sh
source scripts/cmake.sh

echo "building the program: 10 to 20 minutes of the processor the first time"
cargo build --release --locked --package flexbody
mkdir -p target/quickstart
cargo run --release --locked --quiet --package flexbody -- convert fixtures/models/connecting_rod/model.toml \
    -o target/quickstart/connecting_rod.flex.h5 --report target/quickstart/connecting_rod.html

echo
echo "flexible body: target/quickstart/connecting_rod.flex.h5"
echo "report:        target/quickstart/connecting_rod.html"
echo
echo 'next: export PATH="$PWD/target/release:$PATH", then docs/start/tour.md'
