"""GetFEM: a steel block of quadratic bricks as a flexible body.

    python getfem_block.py && flexbody convert --stiffness K.mtx --mass M.mtx --nodes nodes.csv --units m,kg,s -o block.flex.h5
"""

import getfem
import numpy as np

mesh = getfem.Mesh("cartesian", np.linspace(0, 0.3, 7), np.linspace(0, 0.1, 4), np.linspace(0, 0.08, 3))
rule = getfem.MeshIm(mesh, getfem.Integ("IM_GAUSS_PARALLELEPIPED(3,5)"))
space = getfem.MeshFem(mesh, 3)
space.set_fem(getfem.Fem("FEM_QK(3,2)"))
data = getfem.MeshFem(mesh, 1)
data.set_fem(getfem.Fem("FEM_QK(3,0)"))
E, nu, rho = 2.1e11, 0.3, 7850.0
every = np.ones(data.nbdof())
# No bricks of conditions: the body is free.
K = getfem.asm_linear_elasticity(rule, space, data, E * nu / (1 + nu) / (1 - 2 * nu) * every, E / 2 / (1 + nu) * every)
M = getfem.asm_mass_matrix(rule, space)
M.scale(rho)
K.save("mm", "K.mtx")
M.save("mm", "M.mtx")
# One place for each row: x, y, z of one node after the other.
places = space.basic_dof_nodes()[:, ::3].T
nodes = np.column_stack([np.arange(1, len(places) + 1), places])
np.savetxt("nodes.csv", nodes, fmt=["%d"] + 3 * ["%.17g"], delimiter=",", header="node,x,y,z", comments="")
