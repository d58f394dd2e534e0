#!/bin/sh
# From a geometry to a flexible body: Gmsh makes the mesh (mesh.inp, with a node set for each hole), CalculiX the matrices
# (job.sti, job.mas, job.dof), flexbody the body.
#
#     examples/from_cad/run.sh [FOLDER]
#
# The files appear in FOLDER, target/from_cad without. GMSH, CCX and FLEXBODY name the programs where they are not on the PATH.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
place=${1:-$here/../../target/from_cad}
mkdir -p "$place"
cp "$here/bracket.geo" "$here/job.inp" "$place"
cd "$place"
"${GMSH:-gmsh}" -3 bracket.geo -format inp -o mesh.inp -v 2
"${CCX:-ccx}" -i job > ccx.log || { cat ccx.log; exit 1; }
"${FLEXBODY:-flexbody}" convert job.inp --units mm,t,s --modes 12 \
    --interface bolt_a=BOLT_A,rigid --interface bolt_b=BOLT_B,rigid --interface pin=BORE,averaging \
    -o bracket.flex.h5 --report bracket.html
