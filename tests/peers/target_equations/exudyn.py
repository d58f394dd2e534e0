"""Exudyn: `ObjectFFRFreducedOrder` with the equations that FEM.py publishes (`UFmassFFRFreducedOrder`, `UFforceFFRFreducedOrder` of `ObjectFFRFreducedOrderInterface`).

Columns of the invariants are by modes: zetaI = kron(q, I). Gravity is that of `UFforceFFRFreducedOrder`, whose moment takes the undeformed centre of mass. A force and a
moment act through `MarkerSuperElementRigid` with the nodes and weights of `interfaces` (mean of the nodes, and the rotation of `useAlternativeApproach`,
CObjectFFRFreducedOrder.cpp, `GetAccessFunctionSuperElement`), with the lever of `offset`.
"""

import h5py
import numpy as np

from .equations import Equations, Place, assemble
from .oracle import skew


class Exudyn(Equations):
    # The moment of `UFforceFFRFreducedOrder` is that of the undeformed centre of mass.
    gravity_order = "undeformed"
    ARRAYS = {"total": "m", "chi": "L", "chi_tilde": "L", "inertia": "mL2", "mff": "1", "kff": "own", "dff": "own", "phi_psi": "s", "phi_psi_tilde": "s", "x_psi": "sL", "x_psi_tilde": "sL",
              "psi_psi": "1", "psi_tilde_psi_tilde": "1"}

    def __init__(self, path):
        with h5py.File(path) as file:
            get = lambda name: np.array(file[name][()], float)
            self.total, self.chi, self.inertia = float(file["totalMass"][()]), get("chiU"), get("inertiaLocal")
            self.chi_tilde = get("chiUtilde")
            self.mff, self.kff = get("massMatrixReduced"), get("stiffnessMatrixReduced")
            # Not read by `LoadFromFile`: the program beside the file gives it to the object.
            self.dff = get("dampingMatrixReduced") if "dampingMatrixReduced" in file else np.zeros_like(self.kff)
            self.phi_psi, self.phi_psi_tilde = get("mPhitTPsi"), get("mPhitTPsiTilde")
            self.x_psi, self.x_psi_tilde = get("mXRefTildePsi"), get("mXRefTildePsiTilde")
            self.psi_psi, self.psi_tilde_psi_tilde = get("mPsiTildePsi"), get("mPsiTildePsiTilde")
            self.positions = get("xRef").reshape(-1, 3)
            self.shape = get("modeBasis").reshape(len(self.positions), 3, -1)
            self.rotation = None
            self.ids = file["nodeNumbers"][()]
            self.general = file["massMatrixReduced"].attrs.get("mass_structure", b"") in (b"general", "general")
            self.places, file_interfaces = {}, {}
            for key in file["interfaces"]:
                entry = file["interfaces"][key]
                nodes, weights = entry["meshNodeNumbers"][()].astype(int), entry["weights"][()]
                file_interfaces[key] = nodes
                self.places[key] = self.marker(nodes, weights, entry["offset"][()], entry["marker"][()] in (b"rigid", "rigid"))
        self.whole_nodes(file_interfaces)
        self.modes = len(self.mff)
        self.order = "undeformed" if self.general else "exact"

    def whole_nodes(self, interfaces):
        """Adds the nodes that are interfaces by themselves: the file has six nodes around each, and their mean is the node."""
        for key, nodes in interfaces.items():
            number = set(self.ids[nodes])
            if len(nodes) > 1 and len(number) == 1:
                place = self.places[key]
                self.ids = np.concatenate([np.where(np.isin(np.arange(len(self.ids)), nodes), -1, self.ids), [number.pop()]])
                self.positions = np.vstack([self.positions, place.position])
                self.shape = np.concatenate([self.shape, place.translation[None]])

    def marker(self, nodes, weights, offset, rigid):
        mean = weights @ self.positions[nodes]
        translation = np.einsum("n,naj->aj", weights, self.shape[nodes])
        if not rigid:
            return Place(mean, translation)
        levers = skew(self.positions[nodes] - mean)
        inverse = np.linalg.inv(-np.einsum("n,nab,nbc->ac", weights, levers, levers))
        rotation = inverse @ np.einsum("n,nab,nbj->aj", weights, levers, self.shape[nodes])
        return Place(mean + offset, translation - skew(offset) @ rotation, rotation)

    def parts(self, q):
        zeta = np.kron(q, np.eye(3)).T
        lever = self.total * self.chi_tilde + self.phi_psi_tilde @ zeta
        linear = self.x_psi_tilde @ zeta
        inertia = self.inertia + linear + linear.T + zeta.T @ self.psi_tilde_psi_tilde @ zeta
        return zeta, lever, inertia

    def mass(self, q):
        zeta, lever, inertia = self.parts(q)
        out = assemble(self.total, np.zeros(3), self.phi_psi, inertia, -(self.x_psi + zeta.T @ self.psi_psi), self.mff)
        out[:3, 3:6], out[3:6, :3] = -lever, -lever.T
        return out

    def velocity_forces(self, q, w, qd):
        zeta, lever, inertia = self.parts(q)
        rate, turn = np.kron(qd, np.eye(3)).T, skew(w)
        force = turn @ lever @ w + 2 * self.phi_psi_tilde @ rate @ w
        moment = -turn @ inertia @ w - 2 * (self.x_psi_tilde @ rate + zeta.T @ self.psi_tilde_psi_tilde @ rate) @ w
        spread = np.kron(np.eye(self.modes), w).T
        modal = spread.T @ (self.x_psi_tilde.T + self.psi_tilde_psi_tilde @ zeta) @ w + 2 * self.psi_psi.T @ rate @ w
        return -np.concatenate([force, moment, modal])

    def elastic(self, q, qd):
        return self.kff @ q + self.dff @ qd

    def gravity(self, q, g):
        return np.concatenate([self.total * g, skew(self.chi) @ (self.total * g), self.phi_psi.T @ g])
