#!/bin/sh
# docs/start/tutorial.md from its first command to its last: from a geometry to the vibration of the part in a multibody program.
#
#     examples/from_cad/tutorial.sh [FOLDER]
#
# The files appear in FOLDER, target/from_cad without. GMSH, CCX, FLEXBODY and PYTHON name the programs where they are not on the PATH;
# Python needs exudyn, h5py and numpy.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
place=${1:-$here/../../target/from_cad}
flexbody=${FLEXBODY:-flexbody}
"$here/run.sh" "$place"
cd "$place"
"$flexbody" view bracket.flex.h5 -o bracket_modes.html
"$flexbody" export bracket.flex.h5 --to vtk -o bracket.vtu
"$flexbody" export bracket.flex.h5 --to gltf -o bracket.glb
"$flexbody" check bracket.flex.h5 --against job.inp --units mm,t,s \
    --interface bolt_a=BOLT_A,rigid --interface bolt_b=BOLT_B,rigid --interface pin=BORE,averaging
"$flexbody" convert job.inp --units mm,t,s --basis craig-bampton --modes 8 --frame model \
    --interface bolt_a=BOLT_A,rigid --interface bolt_b=BOLT_B,rigid --interface pin=BORE,averaging \
    -o bracket_cb.flex.h5 --report bracket_cb.html
"$flexbody" export bracket_cb.flex.h5 --to exudyn --points interfaces -o bracket_cb.hdf5
"${PYTHON:-python3}" "$here/shaker.py" .
