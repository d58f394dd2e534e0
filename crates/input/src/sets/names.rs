//! Names of sets and of instances: the form in which they are compared, and names of both, `INSTANCE.SET`.

/// Largest number of dots of a name `INSTANCE.SET` at which the name of the instance may end.
const MAX_DOTS: usize = 20;

/// Returns the ways to divide `INSTANCE.REST`. Names may contain dots.
pub(crate) fn dotted(name: &str) -> impl Iterator<Item = (&str, &str)> {
    name.match_indices('.').take(MAX_DOTS).map(|(dot, _)| (&name[..dot], &name[dot + 1..]))
}

/// Returns a name in the form in which names are compared: in upper case, without blanks.
pub(crate) fn comparable(name: &str) -> String {
    name.split_whitespace().collect::<String>().to_uppercase()
}
