"""FEniCSx: a steel block of quadratic tetrahedra as a flexible body.

    python fenicsx.py && flexbody convert --stiffness K.petsc --mass M.petsc --nodes nodes.csv --units m,kg,s -o block.flex.h5

Run it on one process: on several, rows and places would have to be gathered.
"""

import numpy as np
import ufl
from dolfinx import fem, mesh
from dolfinx.fem.petsc import assemble_matrix
from mpi4py import MPI
from petsc4py import PETSc

block = mesh.create_box(MPI.COMM_SELF, [[0, 0, 0], [0.3, 0.1, 0.08]], [6, 3, 2])
if hasattr(fem, "functionspace"):
    space = fem.functionspace(block, ("Lagrange", 2, (3,)))
else:  # before version 0.7
    space = fem.VectorFunctionSpace(block, ("Lagrange", 2))
u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
E, nu, rho = 2.1e11, 0.3, 7850.0
lam, mu = E * nu / (1 + nu) / (1 - 2 * nu), E / 2 / (1 + nu)
strain = lambda w: ufl.sym(ufl.grad(w))
forms = {"K": 2 * mu * ufl.inner(strain(u), strain(v)) + lam * ufl.div(u) * ufl.div(v), "M": rho * ufl.inner(u, v)}
for name, form in forms.items():
    matrix = assemble_matrix(fem.form(form * ufl.dx))  # no `bcs`: the body is free
    matrix.assemble()
    matrix.view(PETSc.Viewer().createBinary(f"{name}.petsc", "w", comm=MPI.COMM_SELF))
# One place for each node, whose rows are x, y, z.
places = space.tabulate_dof_coordinates()
nodes = np.column_stack([np.arange(1, len(places) + 1), places])
np.savetxt("nodes.csv", nodes, fmt=["%d"] + 3 * ["%.17g"], delimiter=",", header="node,x,y,z", comments="")
