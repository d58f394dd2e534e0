"""scikit-fem: a steel block of quadratic bricks as a flexible body.

    python scikit_fem.py && flexbody convert --stiffness K.npz --mass M.npz --nodes nodes.csv --units m,kg,s -o block.flex.h5
"""

import numpy as np
import scipy.sparse
import skfem
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

mesh = skfem.MeshHex.init_tensor(np.linspace(0, 0.3, 7), np.linspace(0, 0.1, 4), np.linspace(0, 0.08, 3))
basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex2()))
density = skfem.BilinearForm(lambda u, v, w: 7850.0 * dot(u, v))
# No boundary conditions: the body is free. Both matrices have the same rule of integration, which is exact for the mass.
K = linear_elasticity(*lame_parameters(2.1e11, 0.3)).assemble(basis)
M = density.assemble(basis)
scipy.sparse.save_npz("K.npz", K)
scipy.sparse.save_npz("M.npz", M)
# The rows of ElementVector are x, y, z of one node after the other, as flexbody takes them without labels.
places = basis.doflocs[:, ::3].T
nodes = np.column_stack([np.arange(1, len(places) + 1), places])
np.savetxt("nodes.csv", nodes, fmt=["%d"] + 3 * ["%.17g"], delimiter=",", header="node,x,y,z", comments="")
