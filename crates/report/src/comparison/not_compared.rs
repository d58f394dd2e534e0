//! Entries of the flex-body file that a comparison leaves out.

use flexbody_body::flex_body::FlexBody;

/// Entries of the file that belong together.
struct Entries {
    /// Name of the entries.
    name: &'static str,
    /// Paths of the entries in the file.
    paths: &'static str,
    /// True if a body has such entries.
    has: fn(&FlexBody) -> bool,
}

/// Entries that are never compared: they record the origin and the proofs of a body, or follow from other
/// entries.
const NEVER_COMPARED: &[Entries] = &[
    Entries { name: "provenance", paths: "/@generator, /@format_minor, /source", has: |_| true },
    Entries {
        name: "proofs and error estimates",
        paths: "/certificate, /modes/residual, /modes@provenance, /modes@truncation",
        has: |_| true,
    },
    Entries {
        name: "guaranteed bounds",
        paths: "/modes/eigenvalue_lower, /modes/eigenvalue_upper, /modes/shape_error",
        has: |body| body.certificate().guarantee.is_some(),
    },
    Entries {
        name: "estimates of the free body",
        paths: "/modes/free_eigenvalue, /modes/free_eigenvalue_lower",
        has: |body| body.certificate().fixed_interface.is_some(),
    },
    Entries {
        name: "reasons of kept and dropped terms",
        paths: "/terms",
        has: |body| !body.terms().is_empty(),
    },
    Entries {
        name: "lumped comparators",
        paths: "/lumped, /comparison",
        has: |body| !body.lumped().is_empty(),
    },
    Entries { name: "surface", paths: "/mesh", has: |body| body.mesh().is_some() },
    Entries { name: "recoveries", paths: "/recovery", has: |body| !body.recoveries().is_empty() },
    Entries {
        name: "matrices in interface coordinates, which `flexbody check` holds to the modes",
        paths: "/interface_coordinates",
        has: |body| body.coordinates().is_some(),
    },
];

/// Entries that are compared only if both bodies have the same nodes.
const WITH_COMMON_NODES: &[Entries] = &[
    Entries {
        name: "nodes and modes at them",
        paths: "/nodes, /modes/shape, /modes/rotation, /modes/internal",
        has: |_| true,
    },
    Entries {
        name: "nodes of interfaces",
        paths: "/interfaces/<name>/node_id",
        has: |body| !body.interfaces().is_empty(),
    },
    Entries {
        name: "first and second moment, modal stiffness",
        paths: "/invariants/first_moment, /invariants/second_moment, /invariants/modal_stiffness",
        has: |_| true,
    },
    Entries {
        name: "invariants of a mass of structure `general`",
        paths: "/invariants/W0, /invariants/W3, /invariants/C2, /invariants/modal_mass",
        has: |body| body.invariants().general().is_some(),
    },
];

/// Returns the entries of `a` or `b` that are not compared, as `name (paths)`.
pub(super) fn entries(a: &FlexBody, b: &FlexBody, same_nodes: bool) -> Vec<String> {
    let by_nodes = WITH_COMMON_NODES.iter().filter(|_| !same_nodes);
    let present =
        NEVER_COMPARED.iter().chain(by_nodes).filter(|entries| (entries.has)(a) || (entries.has)(b));
    present.map(|Entries { name, paths, .. }| format!("{name} ({paths})")).collect()
}
