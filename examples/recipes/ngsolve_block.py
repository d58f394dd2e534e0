"""NGSolve: a steel block of curved-order tetrahedra as a flexible body.

    python ngsolve_block.py && flexbody convert --stiffness K.npz --mass M.npz --nodes nodes.csv --dofs dofs.csv --units m,kg,s -o block.flex.h5
"""

import numpy as np
import scipy.sparse
from netgen.occ import Box, OCCGeometry
from ngsolve import BilinearForm, Grad, InnerProduct, Mesh, Sym, VectorH1, div, dx

mesh = Mesh(OCCGeometry(Box((0, 0, 0), (0.3, 0.1, 0.08))).GenerateMesh(maxh=0.05))
space = VectorH1(mesh, order=2)  # no `dirichlet`: the body is free
u, v = space.TnT()
E, nu, rho = 2.1e11, 0.3, 7850.0
lam, mu = E * nu / (1 + nu) / (1 - 2 * nu), E / 2 / (1 + nu)
forms = {"K": 2 * mu * InnerProduct(Sym(Grad(u)), Sym(Grad(v))) + lam * div(u) * div(v), "M": rho * u * v}
for name, form in forms.items():
    matrix = BilinearForm(form * dx).Assemble().mat
    scipy.sparse.save_npz(f"{name}.npz", scipy.sparse.csr_matrix(matrix.CSR(), shape=(matrix.height, matrix.width)))
# Rows stand component by component. The functions of order 2 belong to edges: they are rows of nodes without a place.
each = space.ndof // 3
rows = [(row % each + 1, row // each + 1) for row in range(space.ndof)]
np.savetxt("dofs.csv", rows, fmt="%d", delimiter=",", header="node,dir", comments="")
nodes = [(k + 1, *vertex.point) for k, vertex in enumerate(mesh.vertices)]
np.savetxt("nodes.csv", nodes, fmt=["%d"] + 3 * ["%.17g"], delimiter=",", header="node,x,y,z", comments="")
