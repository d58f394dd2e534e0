//! A cache of the indices of recent labels in a list of labels.

/// Cache that numbers labels as they come. A label that was displaced by others is added to the list again.
pub(crate) struct Recent<T> {
    slots: Vec<Option<(T, u32)>>,
}

impl<T: Copy + PartialEq> Recent<T> {
    const BITS: u32 = 12;

    pub(crate) fn new() -> Self {
        Self { slots: vec![None; 1 << Self::BITS] }
    }

    /// Returns the index of a label in `labels`, to which the label is added if it is not in the cache. Labels of one
    /// node differ in `direction`.
    pub(crate) fn place(&mut self, label: T, (node, direction): (i64, u8), labels: &mut Vec<T>) -> u32 {
        let key = (node as u64).wrapping_mul(8).wrapping_add(u64::from(direction));
        let slot = &mut self.slots[(key.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> (64 - Self::BITS)) as usize];
        match *slot {
            Some((known, at)) if known == label => at,
            _ => {
                let at = labels.len() as u32;
                labels.push(label);
                *slot = Some((label, at));
                at
            }
        }
    }
}
