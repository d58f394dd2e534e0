//! Replication: `=` copies the field of the card above, `*(x)` adds x to that field, `==` copies all fields from there
//! on, and `=(n)` repeats the line above it n times.

use super::{Card, Line, fixed_fields, free_fields};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::scanner::{real, whole};

/// Largest number of cards that one line may represent.
const MAX_REPEATED_CARDS: i64 = 1_000_000;

/// Change of a field from card to card.
#[derive(Clone)]
enum Change {
    Same,
    /// Adds a number to the field.
    More(Vec<u8>),
    /// Replaces the field by this text.
    Text(Vec<u8>),
}

/// Changes that a line of replication makes to the card above it.
#[derive(Clone, Default)]
pub(super) struct Replication {
    changes: Vec<Change>,
}

/// Request of a line that begins with `=`.
pub(super) enum ReplicationRequest {
    /// One card.
    One(Replication),
    /// Number of cards, each made by the preceding replication.
    Repeat(i64),
}

impl Replication {
    /// Reads a line of replication. Returns `None` if it does not begin with `=`.
    ///
    /// # Errors
    /// FB110 for invalid counts, and fields beyond the line.
    pub(super) fn request(line: &Line<'_>) -> Result<Option<ReplicationRequest>, Diagnostic> {
        let Some(rest) = line.head().strip_prefix(b"=") else { return Ok(None) };
        if !rest.is_empty() && rest != b"=" {
            let count =
                whole(without_brackets(rest)).filter(|count| (1..=MAX_REPEATED_CARDS).contains(count));
            let message = "expected a number of repetitions, as in =(4)";
            return count.map(|count| Some(ReplicationRequest::Repeat(count))).ok_or_else(|| bad(message));
        }
        let mut given = Card::default();
        if line.is_free {
            free_fields(&mut given, &line.text, 8)?
        } else {
            fixed_fields(&mut given, &line.text, 8)
        }
        let mut changes = Vec::new();
        let mut all_same = rest == b"=";
        for k in 0..8 {
            let field = given.field(k);
            all_same |= field == b"==";
            changes.push(match field {
                _ if all_same => Change::Same,
                b"=" => Change::Same,
                [b'*', more @ ..] => Change::More(without_brackets(more).to_vec()),
                text => Change::Text(text.to_vec()),
            });
        }
        Ok(Some(ReplicationRequest::One(Self { changes })))
    }

    /// Returns the card that follows `card`.
    ///
    /// # Errors
    /// FB110 if there is no card of one line above, or a field is no number.
    pub(super) fn next(&self, card: &Card) -> Result<Card, Diagnostic> {
        if card.name.is_empty() || self.changes.is_empty() {
            return Err(bad("there is no card above to replicate"));
        }
        if card.lines.len() != 1 || card.name == "DMIG" {
            let message = format!("replication of a {} with continuations is not read", card.name);
            return Err(bad(&message).with_help("write the cards one by one"));
        }
        let mut next = Card::default();
        next.begin(card.name.clone());
        for (k, change) in self.changes.iter().enumerate() {
            let field = match change {
                Change::Same => card.field(k).to_vec(),
                Change::Text(text) => text.clone(),
                Change::More(more) => sum(card.field(k), more).ok_or_else(|| {
                    bad(&format!(
                        "field {} of the {} is not a number that can be incremented",
                        k + 1,
                        card.name
                    ))
                })?,
            };
            next.push(&field);
        }
        Ok(next)
    }
}

/// Returns the sum of two numbers as the text of a field.
fn sum(field: &[u8], more: &[u8]) -> Option<Vec<u8>> {
    let field: &[u8] = if field.is_empty() { b"0" } else { field };
    if let (Some(a), Some(b)) = (whole(field), whole(more)) {
        return Some(a.checked_add(b)?.to_string().into_bytes());
    }
    let sum = real(field)? + real(more)?;
    sum.is_finite().then(|| format!("{sum:e}").into_bytes())
}

fn without_brackets(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"(").and_then(|text| text.strip_suffix(b")")).unwrap_or(text).trim_ascii()
}

fn bad(message: &str) -> Diagnostic {
    Diagnostic::new(Code::DeckSyntax, message)
}
