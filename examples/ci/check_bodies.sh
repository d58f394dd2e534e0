#!/usr/bin/env bash
# Bodies under test in continuous integration: converts every model again and compares the body with the released one.
#
#   check_bodies.sh RELEASED REPORTS MODEL.toml...
#
# RELEASED has a file NAME.flex.h5 for each model, NAME being that of its folder. In REPORTS come, for each, the new body, a page for people
# (NAME.html), test cases for the CI system (NAME.xml, JUnit) and the tables of all in summary.md. The exit code is 1 where a body differs.
set -euo pipefail

released=$1 reports=$2
shift 2
mkdir -p "$reports"
: > "$reports/summary.md"
failed=0
for model in "$@"; do
    name=$(basename "$(dirname "$(realpath "$model")")")
    new="$reports/$name.flex.h5"
    flexbody convert "$model" -o "$new" --report "$reports/$name.json" --quiet
    # Another processor, or a newer version, may round differently: frequencies and invariants are compared to 1e-7.
    if ! flexbody compare "$released/$name.flex.h5" "$new" --frequency 1e-7 --invariants 1e-7 --quiet \
        --report "$reports/$name.html" --report "$reports/$name.xml" --report "$reports/$name.md"; then
        failed=1
    fi
    if [ -f "$reports/$name.md" ]; then
        cat "$reports/$name.md" >> "$reports/summary.md"
    fi
done
exit "$failed"
