//! Conditions on the parts of a flexible body, checked once; all violations are collected.

use super::{
    LOAD_COMPONENTS, LoadColumns, LoadKind, MassStructure, MotionColumns, Parts, ReferenceConditions,
    SurfaceMesh, TermGroup,
};
use crate::invariants::{DIGITS, InertiaStiffness};
use crate::problems::{MAX_NUMBER, Problems};
use flexbody_base::diagnostic::Diagnostic;
use flexbody_model::{Coupling, UnitLoad};
use nalgebra::Matrix3;
use std::collections::HashSet;

/// Largest deviation of the axes from orthonormality. Axes from an eigen-decomposition of a 3x3 matrix
/// reach 1e-15; a rotation typed in may have 12 digits. Larger deviations would rotate the invariants by
/// more than their own accuracy.
const AXES_TOLERANCE: f64 = 1e-10;

pub(super) fn problems(parts: &Parts) -> Vec<Diagnostic> {
    let mut check = Problems::default();
    let (n, nf) = (parts.nodes.ids.len(), parts.modes.eigenvalue.len());
    check.sizes(n, nf, parts);
    check.plane(parts);
    check.frame(parts);
    check.nodes(parts);
    check.mesh(parts, n);
    check.modes(parts, n, nf);
    let (hertz, time) = (parts.description.units.hertz(), &parts.description.units.time);
    if !(hertz.is_finite() && hertz * MAX_NUMBER.sqrt() <= MAX_NUMBER) {
        check.add(format!("`units.time` is {} s, too short for frequencies in hertz", time.name()));
    }
    check.extend(parts.invariants.problems("invariants", nf));
    if parts.invariants.mass().is_finite() && parts.invariants.mass() <= 0.0 {
        check.add(format!("`invariants.mass` is {:e}, expected a positive mass", parts.invariants.mass()));
    }
    check.structure(parts);
    check.geometric_stiffness(parts, nf);
    check.estimated_stiffness(parts, nf);
    check.rotated_stiffness(parts, nf);
    check.inertia_stiffness(parts, n, nf);
    check.lumped(parts, nf);
    let c = &parts.certificate;
    check.finite(
        "certificate",
        [c.shift, c.rigid_noise, c.rigid_residual, c.eigenvalue_rounding, c.inertia_rounding],
    );
    check.guarantee(parts, nf);
    check.fixed_interface(parts, nf);
    check.terms(parts);
    check.interfaces(parts, n);
    check.reference_conditions(parts);
    check.coordinates(parts, nf);
    check.recoveries(parts, nf);
    check.named_loads(parts, nf);
    for (field, text) in parts.description.texts() {
        check.text(&format!("source.{field}"), text);
    }
    if let Some(number) = parts.description.number.filter(|n| n.number == 0 || n.number > n.of) {
        check.add(format!("`source.number` is {number}"));
    }
    check.text("certificate.remark", &c.remark);
    check.found()
}

impl Problems {
    fn sizes(&mut self, n: usize, nf: usize, parts: &Parts) {
        let modes = &parts.modes;
        let internal = modes.internal.as_ref().map_or(0, |internal| internal.dofs.len());
        let rows = if modes.rotation.is_some() { 6 * n } else { 3 * n } + internal;
        if n == 0 {
            self.add("`nodes` is empty, expected at least one node".to_owned());
        }
        if nf == 0 {
            self.add("`modes` is empty, expected at least one mode".to_owned());
        } else if n > 0 && nf > rows && parts.source.n_dofs > 0 {
            self.add(format!("{nf} modes of {n} nodes, expected at most {rows}"));
        }
    }

    /// Checks that a plane body has its frame in the plane, and that neither nodes nor modes leave it.
    fn plane(&mut self, parts: &Parts) {
        match parts.dimension {
            3 => return,
            2 => {}
            other => return self.add(format!("`dimension` is {other}, expected 2 or 3")),
        }
        let z = parts.frame.axes.column(2);
        if (z[0], z[1], z[2]) != (0.0, 0.0, 1.0) {
            self.add(format!(
                "`frame.axes` of a plane body have the third axis {:?}, expected z",
                [z[0], z[1], z[2]]
            ));
        }
        if let Some(i) = parts.nodes.positions.iter().position(|x| x[2] != 0.0) {
            self.add(format!(
                "`nodes.positions` of a plane body has z = {:e} at index {i}",
                parts.nodes.positions[i][2]
            ));
        }
        let shape = &parts.modes.shape;
        if (0..shape.ncols()).any(|j| (2..shape.nrows()).step_by(3).any(|row| shape[(row, j)] != 0.0)) {
            self.add("`modes.shape` of a plane body has components along z".to_owned());
        }
    }

    fn frame(&mut self, parts: &Parts) {
        let frame = &parts.frame;
        self.finite("frame.origin", frame.origin.iter().copied());
        self.finite("frame.axes", frame.axes.iter().copied());
        let defect = (frame.axes.transpose() * frame.axes - Matrix3::identity()).amax();
        if defect.is_finite() && defect > AXES_TOLERANCE {
            self.add(format!(
                "`frame.axes` are not orthonormal: max |A'A - I| = {defect:.1e}, expected at most {AXES_TOLERANCE:e}"
            ));
        } else if frame.axes.determinant() < 0.0 {
            self.add("`frame.axes` are left-handed, expected right-handed axes".to_owned());
        }
    }

    fn nodes(&mut self, parts: &Parts) {
        let nodes = &parts.nodes;
        self.length("nodes.positions", nodes.positions.len(), nodes.ids.len(), "node");
        self.finite("nodes.positions", nodes.positions.iter().flatten().copied());
        let mut seen = HashSet::with_capacity(nodes.ids.len());
        if let Some(id) = nodes.ids.iter().find(|&&id| !seen.insert(id)) {
            self.add(format!("`nodes.ids` has node {id} twice, expected unique node numbers"));
        }
    }

    /// Checks that the mesh, valid in itself, refers to existing nodes.
    fn mesh(&mut self, parts: &Parts, n: usize) {
        let least = parts.mesh.as_ref().map_or(0, SurfaceMesh::least_nodes);
        if least > n {
            self.add(format!("`mesh` names node index {}, expected indices below {n}", least - 1));
        }
    }

    fn modes(&mut self, parts: &Parts, n: usize, nf: usize) {
        let modes = &parts.modes;
        self.finite("modes.eigenvalue", modes.eigenvalue.iter().copied());
        if let Some(j) = modes.eigenvalue.iter().position(|&l| l <= 0.0) {
            let l = modes.eigenvalue[j];
            self.add(format!("`modes.eigenvalue` is {l:e} at mode {j}, expected positive values"));
        }
        if let Some(j) = modes.eigenvalue.windows(2).position(|w| w[0] > w[1]) {
            let (a, b) = (modes.eigenvalue[j], modes.eigenvalue[j + 1]);
            self.add(format!(
                "`modes.eigenvalue` falls from {a:e} to {b:e} at mode {}, expected ascending values",
                j + 1
            ));
        }
        for (name, column) in
            [("modes.residual", &modes.residual), ("modes.damping_ratio", &modes.damping_ratio)]
        {
            self.length(name, column.len(), nf, "mode");
            self.finite(name, column.iter().copied());
            if let Some(j) = column.iter().position(|&v| v < 0.0) {
                self.add(format!(
                    "`{name}` is {:e} at mode {j}, expected values that are not negative",
                    column[j]
                ));
            }
        }
        if !modes.provenance.is_empty() {
            self.length("modes.provenance", modes.provenance.len(), nf, "mode");
        }
        self.finite("modes.truncation", modes.truncation.iter().flat_map(|t| [t.before, t.after]));
        self.matrix("modes.shape", &modes.shape, 3 * n, nf);
        if let Some(rotation) = &modes.rotation {
            self.matrix("modes.rotation", rotation, 3 * n, nf);
        }
        if let Some(internal) = &modes.internal {
            self.matrix("modes.internal", &internal.shape, internal.dofs.len(), nf);
        }
        if let Some(damping) = &modes.modal_damping {
            self.matrix("modes.modal_damping", damping, nf, nf);
        }
    }

    /// Checks that a body has general terms exactly if its mass is general, and that lumped masses have
    /// none.
    fn structure(&mut self, parts: &Parts) {
        let general = parts.source.mass_structure == MassStructure::General;
        if general != parts.invariants.general().is_some() {
            self.add(
                "`invariants.W0` must exist for the mass structure `general`, and only for it".to_owned(),
            );
        }
        if parts.invariants.general().as_ref().is_some_and(|terms| terms.plane != (parts.dimension == 2)) {
            self.add(format!("`invariants` has general terms of another dimension than {}", parts.dimension));
        }
        if parts.lumped.iter().any(|lumped| lumped.invariants.general().is_some()) {
            self.add("lumped masses have `W0`, expected none: they commute with rotations".to_owned());
        }
    }

    /// Checks that the stiffness of inertia is complete or absent.
    fn inertia_stiffness(&mut self, parts: &Parts, n: usize, nf: usize) {
        let Some(inertia) = &parts.inertia_stiffness else { return };
        if parts.modes.rotation.is_none() {
            self.add("`inertia_stiffness` exists, but the nodes have no rotations".to_owned());
        }
        self.length("inertia_stiffness.moments", inertia.moments.len(), n, "node");
        let numbers = inertia.moments.iter().flat_map(|m| m.first.iter().chain(m.second.iter()).copied());
        self.finite("inertia_stiffness.moments", numbers);
        for stiffness in &inertia.stiffness {
            self.matrix(
                &format!("inertia_stiffness `{}`", stiffness.load.label()),
                &stiffness.matrix,
                nf,
                nf,
            );
        }
        let wanted: Vec<_> = InertiaStiffness::loads(parts.dimension).collect();
        if !inertia.stiffness.iter().map(|one| &one.load).eq(&wanted) {
            let wanted: Vec<String> = wanted.iter().map(UnitLoad::label).collect();
            self.add(format!("`inertia_stiffness` has other loads than {}", wanted.join(", ")));
        }
    }

    fn geometric_stiffness(&mut self, parts: &Parts, nf: usize) {
        let labels: Vec<String> =
            parts.geometric_stiffness.iter().map(|stiffness| stiffness.load.label()).collect();
        self.names("geometric stiffness", labels.iter());
        for (one, label) in parts.geometric_stiffness.iter().zip(&labels) {
            self.text("geometric_stiffness", label);
            self.matrix(&format!("geometric_stiffness `{label}`"), &one.matrix, nf, nf);
            let load = &one.load;
            // A file identifies the load by this name only.
            if UnitLoad::from_label(label).as_ref() != Some(load) {
                self.add(format!("geometric stiffness `{label}` has no component, interface or name"));
            } else if !load.kind.of_dimension(parts.dimension).contains(&load.component) {
                let dimension = parts.dimension;
                self.add(format!("geometric stiffness `{label}` of a body of dimension {dimension}"));
            }
        }
    }

    fn estimated_stiffness(&mut self, parts: &Parts, nf: usize) {
        let labels: Vec<String> =
            parts.estimated_stiffness.iter().map(|stiffness| stiffness.load.label()).collect();
        self.names("estimated stiffness", labels.iter());
        for (one, label) in parts.estimated_stiffness.iter().zip(&labels) {
            self.matrix(&format!("estimated_stiffness `{label}`"), &one.matrix, nf, nf);
            let is_spin = one.load.kind == LoadKind::Spin;
            if !is_spin || !LoadKind::Spin.of_dimension(parts.dimension).contains(&one.load.component) {
                self.add(format!("`estimated_stiffness` has `{label}`, which is no spin of the body"));
            }
        }
    }

    fn rotated_stiffness(&mut self, parts: &Parts, nf: usize) {
        let (given, rotated) = (&parts.geometric_stiffness, &parts.rotated_stiffness);
        if rotated.is_empty() {
            return;
        }
        if !given.iter().map(|one| &one.load).eq(rotated.iter().map(|one| &one.load)) {
            self.add("`rotated_stiffness` has other loads than `geometric_stiffness`".to_owned());
        }
        for stiffness in rotated {
            let label = stiffness.load.label();
            self.matrix(&format!("rotated_stiffness `{label}` of modes"), &stiffness.modes, nf, 3);
            self.matrix(&format!("rotated_stiffness `{label}` of rotations"), &stiffness.rotation, 3, 3);
        }
    }

    fn lumped(&mut self, parts: &Parts, nf: usize) {
        self.names("a lumping scheme", parts.lumped.iter().map(|l| &l.scheme));
        for body in &parts.lumped {
            let name = format!("lumped `{}`", body.scheme);
            self.extend(body.invariants.problems(&name, nf));
            self.names(&format!("an error norm of {name}"), body.comparison.iter().map(|(norm, _)| norm));
            for (norm, value) in &body.comparison {
                self.text(&format!("{name} error norm"), norm);
                self.finite(&format!("{name} {norm}"), [*value]);
            }
        }
    }

    fn fixed_interface(&mut self, parts: &Parts, nf: usize) {
        let Some(fixed) = &parts.certificate.fixed_interface else { return };
        self.finite("fixed_interface", [fixed.shift, fixed.residual, fixed.next.unwrap_or(0.0)]);
        if !fixed.eigenvalues.is_empty() {
            self.length(
                "fixed_interface.eigenvalues",
                fixed.eigenvalues.len(),
                fixed.modes,
                "fixed-interface mode",
            );
            self.finite("fixed_interface.eigenvalues", fixed.eigenvalues.iter().copied());
        }
        let Some(free) = &fixed.free else { return };
        for (name, column) in
            [("fixed_interface.free.estimate", &free.estimate), ("fixed_interface.free.lower", &free.lower)]
        {
            self.length(name, column.len(), nf, "mode");
            self.finite(name, column.iter().copied());
        }
        let free = free.estimate.iter().zip(&free.lower);
        for (j, (value, (estimate, lower))) in parts.modes.eigenvalue.iter().zip(free).enumerate() {
            if !(0.0 <= *lower && lower <= estimate && *estimate > 0.0 && estimate <= value) {
                self.add(format!(
                    "eigenvalue {value:e} of mode {j} has the estimate {estimate:e} and the bound {lower:e} of the free body, expected descending numbers"
                ));
            }
        }
    }

    fn guarantee(&mut self, parts: &Parts, nf: usize) {
        let Some(g) = &parts.certificate.guarantee else { return };
        let rigid = parts.certificate.rigid_modes;
        if g.pivots_below != rigid {
            self.add(format!(
                "`certificate.guarantee` counts {} eigenvalues below the modes, expected the {rigid} rigid modes",
                g.pivots_below
            ));
        }
        self.finite("guarantee.shift_below", [g.shift_below]);
        for (name, column) in [
            ("guarantee.eigenvalue_lower", &g.eigenvalue_lower),
            ("guarantee.eigenvalue_upper", &g.eigenvalue_upper),
            ("guarantee.shape_error", &g.shape_error),
        ] {
            self.length(name, column.len(), nf, "mode");
            self.finite(name, column.iter().copied());
        }
        let bounds = g.eigenvalue_lower.iter().zip(&g.eigenvalue_upper);
        for (j, (value, (lower, upper))) in parts.modes.eigenvalue.iter().zip(bounds).enumerate() {
            if !(g.shift_below <= *lower && lower <= value && value <= upper) {
                self.add(format!(
                    "eigenvalue {value:e} of mode {j} has the bounds {lower:e} and {upper:e} above the shift {:e}, \
                     expected ascending numbers",
                    g.shift_below
                ));
            }
        }
        if let Some(j) = g.shape_error.iter().position(|e| !(0.0..=1.0).contains(e)) {
            self.add(format!(
                "`guarantee.shape_error` is {:e} at mode {j}, expected 0 to 1",
                g.shape_error[j]
            ));
        }
        for (name, digits) in DIGITS.iter().zip(g.digits) {
            if !(0.0..=16.0).contains(&digits) {
                self.add(format!("guaranteed digits of `{name}` are {digits:e}, expected 0 to 16"));
            }
        }
    }

    /// Checks that each group is either held or dropped by a decision.
    fn terms(&mut self, parts: &Parts) {
        let held = parts.invariants.groups();
        for (at, term) in parts.terms.iter().enumerate() {
            let name = term.group.name();
            self.text(&format!("terms.{name}.reason"), &term.reason);
            if parts.terms[..at].iter().any(|earlier| earlier.group == term.group) {
                self.add(format!("`terms` has two decisions about {name}"));
            }
            if term.kept && !held.has(term.group) {
                self.add(format!("`terms` keeps {name}, but `invariants` does not hold it"));
            }
            if term.tier > 2 {
                self.add(format!("`terms.{name}.tier` is {}, expected 0, 1 or 2", term.tier));
            }
            for (what, value) in [("bound", term.bound), ("limit", term.limit)] {
                if value.is_nan() || value < 0.0 {
                    self.add(format!(
                        "`terms.{name}.{what}` is {value:e}, expected a number that is not negative"
                    ));
                }
            }
        }
        let dropped = |group: TermGroup| parts.terms.iter().any(|term| term.group == group && !term.kept);
        for group in TermGroup::ALL {
            let name = group.name();
            match (held.has(group), dropped(group)) {
                (true, true) => self.add(format!("`terms` drops {name}, but `invariants` holds it")),
                (false, false) => self
                    .add(format!("`invariants` does not hold {name}, but no decision of `terms` drops it")),
                _ => {}
            }
        }
        for lumped in parts.lumped.iter().filter(|lumped| lumped.invariants.groups() != held) {
            self.add(format!(
                "lumped `{}` holds other groups of the kinetic energy than `invariants`",
                lumped.scheme
            ));
        }
    }

    fn interfaces(&mut self, parts: &Parts, n: usize) {
        self.names("an interface", parts.interfaces.iter().map(|i| &i.name));
        for interface in &parts.interfaces {
            let name = &interface.name;
            if interface.nodes.is_empty() {
                self.add(format!("interface `{name}` has no nodes"));
            }
            if let Some(node) = interface.nodes.iter().find(|&&node| node >= n) {
                self.add(format!("interface `{name}` names node index {node}, expected indices below {n}"));
            }
            self.finite(&format!("interface `{name}` reference"), interface.reference.into_iter().flatten());
            if interface.coupling == Some(Coupling::Free) && interface.reference.is_some() {
                self.add(format!("interface `{name}` is free, but has a reference point"));
            }
        }
    }

    /// Checks that the interface of the frame exists and has a reference point.
    fn reference_conditions(&mut self, parts: &Parts) {
        let ReferenceConditions::Interface(name) = &parts.conditions else { return };
        match parts.interfaces.iter().find(|interface| interface.name == *name) {
            None => {
                self.add(format!("the frame stands on interface `{name}`, which the body does not have"));
            }
            Some(interface) if interface.reference.is_none() => {
                self.add(format!("the frame stands on interface `{name}`, which has no reference point"));
            }
            Some(_) => {}
        }
    }

    fn coordinates(&mut self, parts: &Parts, nf: usize) {
        let Some(coordinates) = &parts.coordinates else { return };
        let size = coordinates.names.len();
        coordinates.names.iter().for_each(|name| self.text("coordinates.names", name));
        self.matrix("coordinates.of_modes", &coordinates.of_modes, size, nf);
        for (name, matrix) in
            [("coordinates.stiffness", &coordinates.stiffness), ("coordinates.mass", &coordinates.mass)]
        {
            self.matrix(name, matrix, size, size);
            if (matrix.nrows(), matrix.ncols()) == (size, size) && *matrix != matrix.transpose() {
                self.add(format!("`{name}` is not symmetric"));
            }
        }
    }

    fn named_loads(&mut self, parts: &Parts, nf: usize) {
        self.names("a named load", parts.named_loads.iter().map(|load| &load.name));
        for load in &parts.named_loads {
            let name = format!("named load `{}`", load.name);
            self.length(&format!("{name} modal"), load.modal.len(), nf, "mode");
            self.finite(&format!("{name} modal"), load.modal.iter().copied());
            let resultant = load.force.iter().chain(&load.torque).chain(&load.moments);
            self.finite(&format!("{name} resultant"), resultant.copied());
            self.matrix(&format!("{name} turning"), &load.turning, 3, nf);
            self.finite(&format!("{name} compliance"), load.compliance);
            if parts.interfaces.iter().any(|interface| interface.name == load.name) {
                self.add(format!("{name} has the name of an interface"));
            }
        }
    }

    fn recoveries(&mut self, parts: &Parts, nf: usize) {
        self.names("a recovery", parts.recoveries.iter().map(|recovery| &recovery.name));
        for recovery in &parts.recoveries {
            let (name, rows) = (format!("recovery `{}`", recovery.name), recovery.rows.len());
            if rows == 0 {
                self.add(format!("{name} has no rows"));
            }
            for row in &recovery.rows {
                [&row.name, &row.component, &row.unit].into_iter().for_each(|text| self.text(&name, text));
            }
            self.names(&format!("a row of {name}"), recovery.rows.iter().map(|row| &row.name));
            self.length(&format!("{name} offset"), recovery.offset.len(), rows, "row");
            self.finite(&format!("{name} offset"), recovery.offset.iter().copied());
            self.matrix(&format!("{name} modes"), &recovery.modes, rows, nf);
            self.matrix(&format!("{name} spin"), &recovery.spin, rows, LoadKind::SPIN.len());
            self.matrix(&format!("{name} named"), &recovery.named, rows, parts.named_loads.len());
            for MotionColumns { load, columns } in &recovery.motion {
                self.matrix(&format!("{name} {}", load.name()), columns, rows, load.components() * nf);
            }
            if recovery.motion.windows(2).any(|pair| pair[0].load >= pair[1].load) {
                self.add(format!("{name} has columns of motion twice or out of order"));
            }
            self.names(&format!("an interface of {name}"), recovery.loads.iter().map(|load| &load.interface));
            for LoadColumns { interface, columns } in &recovery.loads {
                self.matrix(&format!("{name} loads at `{interface}`"), columns, rows, LOAD_COMPONENTS);
                let known =
                    parts.interfaces.iter().any(|own| own.name == *interface && own.reference.is_some());
                if !known {
                    self.add(format!(
                        "{name} has loads at `{interface}`, which is no interface with a reference point"
                    ));
                }
            }
        }
    }
}
