"""MFEM (PyMFEM): a steel block of quadratic bricks as a flexible body.

    python mfem_block.py && flexbody convert --stiffness K.mtx --mass M.mtx --nodes nodes.csv --units m,kg,s -o block.flex.h5

In C++ the calls are the same; give the stream that PrintMM writes to `precision(17)`.
"""

import mfem.ser as mfem
import numpy as np
import scipy.io
import scipy.sparse

mesh = mfem.Mesh.MakeCartesian3D(6, 3, 2, mfem.Element.HEXAHEDRON, 0.3, 0.1, 0.08)
# Node by node; the same order for the places of the nodes.
mesh.SetCurvature(2, False, 3, mfem.Ordering.byVDIM)
space = mesh.GetNodalFESpace()
E, nu, rho = 2.1e11, 0.3, 7850.0
lam, mu, density = (mfem.ConstantCoefficient(c) for c in (E * nu / (1 + nu) / (1 - 2 * nu), E / 2 / (1 + nu), rho))
integrators = {"K": mfem.ElasticityIntegrator(lam, mu), "M": mfem.VectorMassIntegrator(density)}
for name, integrator in integrators.items():
    form = mfem.BilinearForm(space)
    form.AddDomainIntegrator(integrator)
    form.Assemble()
    form.Finalize()
    A = form.SpMat()  # no essential boundary conditions: the body is free
    matrix = scipy.sparse.csr_matrix((A.GetDataArray(), A.GetJArray(), A.GetIArray()))
    scipy.io.mmwrite(f"{name}.mtx", matrix, symmetry="general", precision=17)
places = np.array(mesh.GetNodes().GetDataArray()).reshape(-1, 3)
nodes = np.column_stack([np.arange(1, len(places) + 1), places])
np.savetxt("nodes.csv", nodes, fmt=["%d"] + 3 * ["%.17g"], delimiter=",", header="node,x,y,z", comments="")
