//! Parsers of options whose values are names, with the help of each value.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use flexbody_body::basis::BasisKind;
use flexbody_body::flex_body::Storage;
use flexbody_eigen::{Accuracy, FactorChoice, Precision};
use flexbody_study::trade::ReferenceChoice;

/// Returns a parser of the names of `all`; the help shows each name with the text of `about`.
pub(super) fn one_of<T: Copy + Send + Sync + 'static>(
    all: &'static [T],
    name: fn(T) -> &'static str,
    about: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    let shown = all.iter().map(|&value| PossibleValue::new(name(value)).help(about(value)));
    let called = move |text: String| all.iter().copied().find(|&value| name(value) == text);
    PossibleValuesParser::new(shown).map(move |text| called(text).expect("one of the possible values"))
}

/// Returns the parser of the bases.
pub(super) fn basis() -> impl TypedValueParser<Value = BasisKind> {
    one_of(BasisKind::ALL, BasisKind::name, |kind| match kind {
        BasisKind::Free => "Free-surface modes, computed by flexbody",
        BasisKind::CraigBampton => {
            "Modes with the interfaces of the manifest held (--modes counts them), and static shapes for unit motions of the interfaces"
        }
        BasisKind::CraigChang => {
            "Free-surface modes (--modes counts them), and static responses to unit loads at the interfaces"
        }
        BasisKind::Imported => {
            "Shapes computed by another program: eigenvectors, static shapes, or a mixture"
        }
        BasisKind::Scene => {
            "The fewest shapes that represent the motion of --scene; another motion may need others"
        }
    })
}

/// Returns the parser of the accuracies.
pub(super) fn accuracy() -> impl TypedValueParser<Value = Accuracy> {
    one_of(Accuracy::ALL, Accuracy::name, |accuracy| match accuracy {
        Accuracy::Fast => "Residual 1e-6, completeness possibly not proved",
        Accuracy::Standard => "Residual 1e-9 or the rounding floor, completeness proved",
        Accuracy::Certified => {
            "Residual 1e-12 or the rounding floor, completeness proved from both sides, guaranteed bounds of every eigenvalue and digits of every invariant"
        }
    })
}

/// Returns the parser of the precisions of the factor.
pub(super) fn factor() -> impl TypedValueParser<Value = FactorChoice> {
    one_of(&FactorChoice::ALL, FactorChoice::name, |factor| match factor {
        FactorChoice::Auto => "The faster of the two that fits into the memory",
        FactorChoice::Always(Precision::Double) => "Double precision",
        FactorChoice::Always(Precision::Single) => "Single precision, corrected in double",
    })
}

/// Returns the parser of the precisions of the file.
pub(super) fn storage() -> impl TypedValueParser<Value = Storage> {
    one_of(Storage::ALL, Storage::name, |storage| match storage {
        Storage::F64 => "64-bit floats",
        Storage::F32 => "32-bit floats",
    })
}

/// Returns the parser of the references for errors.
pub(super) fn reference() -> impl TypedValueParser<Value = ReferenceChoice> {
    one_of(ReferenceChoice::ALL, ReferenceChoice::name, |reference| match reference {
        ReferenceChoice::Full => "The largest body",
        ReferenceChoice::Fine => {
            "A body that is enriched until its estimated error relative to all nodes is at most a hundredth of the tolerances"
        }
        ReferenceChoice::Nodal => "The unreduced equations of all nodes",
    })
}
