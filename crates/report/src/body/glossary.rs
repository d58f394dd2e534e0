//! Technical terms of a report, explained at their place and in a list at the end.

use crate::document::{Block, Span, Term, heading};

/// Terms and their meanings.
const WORDS: [(&str, &str); 14] = [
    (
        "principal moments of inertia",
        "Moments of inertia about the three axes through the centre of mass for which all products of inertia vanish.",
    ),
    (
        "radius of gyration",
        "The distance from an axis at which the whole mass would have the same moment of inertia: sqrt(I / m).",
    ),
    ("free-surface mode", "A natural mode of the body with nothing held."),
    (
        "completeness",
        "Proof that no mode is missing among those found: the number of negative pivots of K - sigma M is the number of all modes below the frequency of sigma (Sylvester's law of inertia).",
    ),
    (
        "residual",
        "Error of a mode as an eigenvector: |K psi - lambda M psi| relative to |K psi| + |lambda M psi|.",
    ),
    (
        "residual vector",
        "The part of the static response to a load that the modes cannot represent, added to the body as one more shape. It is not a natural mode, and its frequency is not a resonance.",
    ),
    ("fixed-interface mode", "A natural mode with all interfaces held, as Craig-Bampton bodies have them."),
    (
        "interface",
        "A named set of nodes that a joint or a load acts on; its coupling says how its reference point follows them.",
    ),
    (
        "W1",
        "The invariant (3 x 3 n) of the change of the inertia with the deflection to first order: I = I0 + W1 Q + Q' W2 Q.",
    ),
    (
        "W2",
        "The invariant (3 n x 3 n) of the inertia to second order in the deflection; it makes the centrifugal forces on the deflected body.",
    ),
    ("W3", "The invariant (3 n x n) of the Coriolis and Euler forces between the modes."),
    ("lumped mass", "Mass put on the nodes as points, instead of the mass matrix of the elements."),
    (
        "geometric stiffness",
        "The stiffness that a preload adds, for example the centrifugal force of a spin.",
    ),
    ("I0", "The inertia of the undeformed body about the origin of its frame."),
];

/// Returns a word with its explanation; a word without one is returned as plain text.
pub(super) fn word(word: &str) -> Span {
    word_as(word, word)
}

/// Returns another form of a known word, such as `W2 (n)` or a plural, with its explanation.
pub(super) fn word_as(known: &str, shown: &str) -> Span {
    match WORDS.iter().find(|(word, _)| *word == known) {
        Some((_, meaning)) => Span::Word(shown.to_owned(), meaning),
        None => Span::Plain(shown.to_owned()),
    }
}

/// Returns all terms as a list at the end of the page, for readers without a pointer.
pub(super) fn glossary<'a>() -> [Block<'a>; 2] {
    let terms = WORDS.map(|(word, meaning)| Term::page(word, meaning)).into();
    [heading("Words"), Block::Fold("Glossary", vec![Block::Terms(terms)])]
}
