//! Random damage to files.

use proptest::prelude::*;

/// Change of the bytes at a position, which is given as a fraction of the length.
#[derive(Debug, Clone)]
pub enum Damage {
    Flip(f64, u8),
    Set(f64, u8),
    Insert(f64, Vec<u8>),
    Remove(f64, usize),
    Repeat(f64, usize),
    CutOff(f64),
}

/// Returns random damage: changed bits and bytes, inserted, removed and repeated pieces, a removed end.
pub fn damage() -> impl Strategy<Value = Damage> {
    let at = 0.0..1.0f64;
    prop_oneof![
        3 => (at.clone(), 0..8u8).prop_map(|(at, bit)| Damage::Flip(at, bit)),
        3 => (at.clone(), prop_oneof![any::<u8>(), prop::sample::select(b"0123456789 \n,;-+.eEnN%#\"[]=\x00\xff".to_vec())])
            .prop_map(|(at, byte)| Damage::Set(at, byte)),
        2 => (at.clone(), proptest::collection::vec(any::<u8>(), 1..6)).prop_map(|(at, b)| Damage::Insert(at, b)),
        2 => (at.clone(), prop::sample::select(vec![&b"\n"[..], b"99999999999999999999", b"-", b"nan", b"1e999", b"\"", b"[["]))
            .prop_map(|(at, b)| Damage::Insert(at, b.to_vec())),
        1 => (at.clone(), 1..40usize).prop_map(|(at, length)| Damage::Remove(at, length)),
        1 => (at.clone(), 1..40usize).prop_map(|(at, length)| Damage::Repeat(at, length)),
        1 => at.prop_map(Damage::CutOff),
    ]
}

/// Damages `bytes`.
pub fn apply(bytes: &mut Vec<u8>, damage: &Damage) {
    let len = bytes.len();
    if len == 0 {
        return;
    }
    let place = |at: f64| ((at * len as f64) as usize).min(len - 1);
    match damage {
        Damage::Flip(at, bit) => bytes[place(*at)] ^= 1 << bit,
        Damage::Set(at, byte) => bytes[place(*at)] = *byte,
        Damage::Insert(at, new) => {
            let at = place(*at);
            bytes.splice(at..at, new.iter().copied());
        }
        Damage::Remove(at, length) => {
            let at = place(*at);
            bytes.drain(at..(at + length).min(len));
        }
        Damage::Repeat(at, length) => {
            let at = place(*at);
            let piece = bytes[at..(at + length).min(len)].to_vec();
            bytes.splice(at..at, piece);
        }
        Damage::CutOff(at) => bytes.truncate(place(*at)),
    }
}
