#!/usr/bin/env bash
# Makes everything of the repository that programs write, by one command each:
#
#   ./scripts/make.sh bless [TEST]     what tests hold and write: reports of broken inputs, golden tables, docs/reference/codes.md, docs/reference/file_format.md, schemas,
#                                      the types of the Python package (_flexbody.pyi)
#   ./scripts/make.sh pages [NAME]     pages of evidence/ (its README has the times), docs/reference/python.md and pictures; without NAME all of them (many hours). NAME:
#                                      accuracy, craig_bampton, cutoff, dynamics, element_proof, embedded, geometric_stiffness, peers, performance, plausibility, python, recovery, seeds, stability,
#                                      trade, verdicts [SEEDS], image_response, image_simulation, image_terminal, image_tutorial, image_view, image_vtk
#   ./scripts/make.sh fixtures NAME    fixtures: models, general, frames, broken, foreign, jobs, modes, open, ... (fixtures/make/make_NAME.py; its head says what it needs)
#   ./scripts/make.sh site             the documentation as a site
#   ./scripts/make.sh wheel            the Python package
#   ./scripts/make.sh release          the files of a release, tested
#
# Read the difference (`git diff`) before it is committed. What a page or a fixture needs beside this repository stands in the head of its
# script; a missing program is named there.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

usage() {
    sed -n '2,/^set /{/^#/s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"
    exit "${1:-2}"
}

what="${1:-}"
name="${2:-}"
case "$what" in
bless)
    # shellcheck source=scripts/cmake.sh
    source scripts/cmake.sh
    export FLEXBODY_BLESS=1
    if [ -n "$name" ]; then
        cargo test --locked "$name" -- --include-ignored
    else
        cargo test --locked --test program -- bad_input docs_generated
        cargo test --locked --package flexbody-body --test body -- --include-ignored work_counters plans
        cargo test --locked --package flexbody-formats --test formats export_embedded
        cargo test --locked --package flexbody-report --test report report
    fi
    ;;
pages)
    # shellcheck source=scripts/cmake.sh
    source scripts/cmake.sh
    case "$name" in
    craig_bampton) "${PYTHON:-python3}" tests/peers/craig_bampton.py ;;
    dynamics) "${PYTHON:-python3}" benches/dynamics.py ;;
    embedded) cargo bench --locked --bench embedded -- --write ;;
    peers) "${PYTHON:-python3}" tests/peers/suite.py --install --write ;;
    performance) ./benches/page.sh ;;
    plausibility) cargo run --release --locked --example plausibility ;;
    recovery)
        "${PYTHON:-python3}" evidence/programs/make_recovery.py "${@:3}"
        FLEXBODY_BLESS=1 cargo test --release --locked --package flexbody-study stresses_in_motion -- --ignored
        ;;
    verdicts) FLEXBODY_BLESS=1 FLEXBODY_VERDICTS="${3:-100}" cargo test --release --locked --package flexbody-study random_verdicts -- --include-ignored ;;
    "")
        for script in evidence/programs/make_*.py scripts/pages/*.py; do "${PYTHON:-python3}" "$script"; done
        for page in craig_bampton dynamics embedded peers performance plausibility verdicts; do ./scripts/make.sh pages "$page"; done
        ;;
    image_*) "${PYTHON:-python3}" "scripts/pages/$name.py" "${@:3}" ;;
    python) "${PYTHON:-python3}" scripts/pages/make_python.py ;;
    *) "${PYTHON:-python3}" "evidence/programs/make_$name.py" "${@:3}" ;;
    esac
    ;;
fixtures)
    [ -n "$name" ] || usage
    python3 "fixtures/make/make_$name.py" "${@:3}"
    ;;
site) ./scripts/site.sh ;;
wheel) ./scripts/wheel.sh "${@:2}" ;;
release) ./scripts/release.sh "${@:2}" ;;
-h | --help | help) usage 0 ;;
*) usage ;;
esac
