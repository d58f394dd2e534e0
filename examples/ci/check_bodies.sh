#!/usr/bin/env bash
# Bodies under test in continuous integration: converts every model again and compares the body with the released one.
#
#   check_bodies.sh RELEASED REPORTS MODEL.toml...
#
# RELEASED has a file NAME.flex.h5 for each model, NAME being that of its folder. In REPORTS come, for each, the new body, a page for people
# (NAME.html), test cases for the CI system (NAME.xml, JUnit) and the tables of all in summary.md. The exit code is 1 where a body differs or
# cannot be compared; the other models are compared all the same.
set -euo pipefail

released=$1 reports=$2
shift 2
mkdir -p "$reports"
: > "$reports/summary.md"
failed=0
for model in "$@"; do
    name=$(basename "$(dirname "$(realpath "$model")")")
    new="$reports/$name.flex.h5"
    # Reports of an earlier run say nothing of this one.
    rm -f "$reports/$name".{flex.h5,json,html,xml,md}
    # Another processor, or a newer version, may round differently: frequencies and invariants are compared to 1e-7.
    flexbody convert "$model" -o "$new" --report "$reports/$name.json" --quiet &&
        flexbody compare "$released/$name.flex.h5" "$new" --frequency 1e-7 --invariants 1e-7 --quiet \
            --report "$reports/$name.html" --report "$reports/$name.xml" --report "$reports/$name.md" || failed=1
    if [ -f "$reports/$name.md" ]; then
        cat "$reports/$name.md" >> "$reports/summary.md"
    else
        printf '### %s\n\nThe body could not be compared: the log of the job says why.\n' "$name" >> "$reports/summary.md"
    fi
    echo >> "$reports/summary.md"
done
exit "$failed"
