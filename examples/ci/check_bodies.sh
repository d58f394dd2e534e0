#!/usr/bin/env bash
# Bodies under test in continuous integration: converts every model again with the settings of its released body, holds the new body to the
# model, and compares it with the released one.
#
#   check_bodies.sh RELEASED REPORTS MODEL.toml...
#
# RELEASED has a file NAME.flex.h5 for each model, NAME being that of its folder; the settings of the conversion (basis, modes, accuracy, frame,
# residual vectors) are read from this file. In REPORTS come, for each, the new body, a page for people (NAME.html), test cases for the CI system
# (NAME.xml, JUnit: also for a body that could not be made or compared) and the tables of all in summary.md. Tolerances by quantity are set by
# FREQUENCY, MASS, INERTIA and INVARIANTS (relative). The exit code is 1 where a body differs or cannot be compared; the other models are
# compared all the same.
set -euo pipefail

# Another processor, or a newer version, may round differently: frequencies and invariants are compared to 1e-7.
FREQUENCY=${FREQUENCY:-1e-7} MASS=${MASS:-1e-9} INERTIA=${INERTIA:-1e-9} INVARIANTS=${INVARIANTS:-1e-7}

released=$1 reports=$2
shift 2
mkdir -p "$reports"
: > "$reports/summary.md"

# Writes a JUnit file and a paragraph of the summary for a body that could not be compared; $2 is the file with the reason.
cannot_compare() {
    local name=$1 reason
    reason=$(sed 's/&/\&amp;/g; s/</\&lt;/g; s/>/\&gt;/g; s/"/\&quot;/g' "$2")
    cat > "$reports/$name.xml" <<XML
<?xml version="1.0" encoding="UTF-8"?>
<testsuites>
  <testsuite name="$name" tests="1" failures="0" errors="1">
    <testcase classname="$name" name="comparison"><error message="the body cannot be compared">$reason</error></testcase>
  </testsuite>
</testsuites>
XML
    printf '### %s\n\nThe body cannot be compared:\n\n```\n%s\n```\n' "$name" "$(cat "$2")" >> "$reports/summary.md"
}

failed=0
for model in "$@"; do
    name=$(basename "$(dirname "$(realpath "$model")")")
    new="$reports/$name.flex.h5" old="$released/$name.flex.h5" log="$reports/$name.log"
    # Reports of an earlier run say nothing of this one.
    rm -f "$reports/$name".{flex.h5,json,html,xml,md,log}
    if ! { flexbody convert "$model" --like "$old" -o "$new" --report "$reports/$name.json" --quiet &&
        flexbody check "$new" --against "$model" --quiet; } 2> "$log"; then
        cannot_compare "$name" "$log"
        failed=1
        continue
    fi
    flexbody compare "$old" "$new" --frequency "$FREQUENCY" --mass "$MASS" --inertia "$INERTIA" --invariants "$INVARIANTS" --quiet \
        --report "$reports/$name.html" --report "$reports/$name.xml" --report "$reports/$name.md" 2> "$log" || failed=1
    if [ -f "$reports/$name.md" ]; then
        cat "$reports/$name.md" >> "$reports/summary.md"
    else
        cannot_compare "$name" "$log"
    fi
    echo >> "$reports/summary.md"
done
cat "$reports/summary.md"
exit "$failed"
