#!/usr/bin/env bash
# All tests, documentation tests included. Arguments go to `cargo test`.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=scripts/cmake.sh
source scripts/cmake.sh

cargo test --locked "$@"
