//! Lists in messages, limited to a few items.

/// Largest number of items named in a message.
const MAX_NAMED: usize = 5;

/// Joins items as `a, b, c and 7 more`.
pub(crate) fn name_some<T: std::fmt::Display>(items: &[T]) -> String {
    let named: Vec<String> = items.iter().take(MAX_NAMED).map(T::to_string).collect();
    match items.len().saturating_sub(MAX_NAMED) {
        0 => named.join(", "),
        more => format!("{} and {more} more", named.join(", ")),
    }
}

/// Formats groups as `8 nodes (1, 2, 3, 4, 5 and 3 more), 1 node (9)`.
pub(crate) fn in_words(groups: &[Vec<i64>]) -> String {
    let group = |nodes: &Vec<i64>| {
        let plural = if nodes.len() == 1 { "" } else { "s" };
        format!("{} node{plural} ({})", nodes.len(), name_some(nodes))
    };
    name_some(&groups.iter().map(group).collect::<Vec<_>>())
}
