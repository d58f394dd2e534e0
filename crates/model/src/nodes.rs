//! Nodes and labels of degrees of freedom.

/// Node numbers and undeformed positions, in the order of the node table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Nodes {
    /// Node numbers of the FE program; gaps and any order are allowed, duplicates are not.
    pub ids: Vec<i64>,
    /// Positions in model axes, model length units (2D tables: z = 0).
    pub positions: Vec<[f64; 3]>,
}

impl Nodes {
    /// Returns the number of nodes.
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Returns true if there are no nodes.
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }
}

/// Label of a matrix row: a direction of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DofLabel {
    /// Node number.
    pub node: i64,
    /// 1, 2, 3: displacement along x, y, z; 4, 5, 6: rotation about x, y, z.
    pub direction: u8,
}

impl std::fmt::Display for DofLabel {
    /// Formats the label as `node 17 uy` or `node 17 rz`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = match self.direction {
            1 => "ux",
            2 => "uy",
            3 => "uz",
            4 => "rx",
            5 => "ry",
            6 => "rz",
            _ => "?",
        };
        write!(f, "node {} {name}", self.node)
    }
}
