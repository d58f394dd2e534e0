#!/usr/bin/env bash
# The tests, documentation tests included, without those that take many seconds each; `--slow` runs these too. Other arguments go to
# `cargo test`.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=scripts/cmake.sh
source scripts/cmake.sh

if [ "${1:-}" = --slow ]; then
    shift
    case " $* " in
        *" -- "*) set -- "$@" --include-ignored ;;
        *) set -- "$@" -- --include-ignored ;;
    esac
fi
cargo test --locked "$@"
