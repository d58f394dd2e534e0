#!/usr/bin/env bash
# Measures all of evidence/pages/performance.md anew: about 100 minutes on two cores, 24 GB of memory. benches/peers/README.md says
# how the peers are installed. Nothing else should run meanwhile.
set -uo pipefail
cd "$(dirname "$0")/.."
source scripts/cmake.sh
cargo build --release --locked || exit
python=target/peers/bin/python
failed=0
measure() {
  echo "$(date +%T) $*"
  "$python" benches/"$@" || failed=1
}
measure performance.py --cases block-100k --peers exudyn slepc
measure tiers.py --cases block-100k block-100k-200-modes shell-200k
measure tiers.py --cases frame-200k cube-100k tet10-100k plate-50k
measure performance.py --cases block-30k --runs 3 --no-floors
measure performance.py --cases cube-30k cube-100k tet10-100k plate-50k shell-200k --peers slepc --runs 3 --no-floors
measure tiers.py --cases cube-300k --runs 1
measure performance.py --cases cube-300k block-300k --peers slepc --runs 1 --no-floors
measure tiers.py --cases lattice-200k cube-1m cube-3m
measure performance.py --cases cube-1m --no-floors
measure readers.py
exit $failed
