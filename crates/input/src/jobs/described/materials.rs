//! Elasticities of the materials of a deck.

use super::super::deck::{Card, Deck, fields};
use crate::element_source::{ANISOTROPIC_CONSTANTS, anisotropic};
use flexbody_base::diagnostic::{Code, Diagnosed};
use flexbody_base::text::scanner::{excerpt, real};
use flexbody_elements::Elasticity;
use std::collections::HashMap;

/// Keywords of a material without effect on the initial stiffness.
const WITHOUT_STIFFNESS: &[&str] = &[
    "DENSITY",
    "EXPANSION",
    "CONDUCTIVITY",
    "SPECIFICHEAT",
    "PLASTIC",
    "CYCLICHARDENING",
    "CREEP",
    "DAMPING",
    "DEPVAR",
    "ELECTRICALCONDUCTIVITY",
];

/// Keywords of materials whose stiffness does not follow from `*ELASTIC`.
const OTHER_STIFFNESS: &[&str] = &[
    "HYPERELASTIC",
    "HYPERFOAM",
    "USERMATERIAL",
    "DEFORMATIONPLASTICITY",
    "VISCOELASTIC",
    "MOHRCOULOMB",
    "LOWDENSITYFOAM",
    "FASTENERPROPERTY",
    "GASKETELASTICITY",
    "NOTENSION",
    "NOCOMPRESSION",
    "POROUSELASTIC",
    "HYPOELASTIC",
    "FAILSTRESS",
];

/// Material of a deck: its elasticity, or the reason in words why it is not described.
pub(super) type Material = Result<Elasticity, String>;

/// Returns the materials of a deck by their names in the form of comparison.
///
/// # Errors
/// FB110 for elasticities that cannot be read.
pub(super) fn materials(deck: &Deck) -> Diagnosed<HashMap<String, Material>> {
    let mut materials = HashMap::new();
    let mut current: Option<String> = None;
    let mut cards: HashMap<String, Vec<&Card>> = HashMap::new();
    for card in deck.cards() {
        let keyword = card.keyword.as_str();
        if keyword == "MATERIAL" {
            let name = card.name("NAME").unwrap_or_default();
            // A name that is used again begins a new material: its lines replace those above.
            cards.insert(name.clone(), Vec::new());
            current = Some(name);
        } else if keyword == "ELASTIC" || OTHER_STIFFNESS.contains(&keyword) {
            let own = current.as_ref().and_then(|name| cards.get_mut(name));
            own.map(|own| own.push(card)).unwrap_or_default();
        } else if !WITHOUT_STIFFNESS.contains(&keyword) && keyword != "INCLUDE" {
            current = None;
        }
    }
    for (name, own) in cards {
        let material = material(deck, &own)?;
        materials.insert(name, material);
    }
    Ok(materials)
}

/// Returns the material of its cards.
fn material(deck: &Deck, cards: &[&Card]) -> Diagnosed<Material> {
    let Some(elastic) = cards.iter().find(|card| card.keyword == "ELASTIC") else {
        let title = cards.first().map_or("no *ELASTIC".to_owned(), |card| format!("*{}", card.title));
        return Ok(Err(title));
    };
    if let Some(other) = cards.iter().find(|card| card.keyword != "ELASTIC") {
        return Ok(Err(format!("*{}", other.title)));
    }
    let kind = elastic.name("TYPE").unwrap_or_else(|| "ISOTROPIC".to_owned());
    let Some(form) = Form::of(&kind) else {
        return Ok(Err(format!("*ELASTIC, TYPE={kind}")));
    };
    if elastic.parameter("MODULI").is_some_and(|moduli| moduli.eq_ignore_ascii_case("INSTANTANEOUS")) {
        return Ok(Err("its elasticity is instantaneous".to_owned()));
    }
    // Data that continue in another file have a separate card.
    let mut numbers = Vec::new();
    let mut n_lines = 0;
    for card in cards {
        for (line, text) in deck.data(card) {
            n_lines += 1;
            if n_lines > form.n_lines() {
                return Ok(Err("its elasticity depends on temperature".to_owned()));
            }
            for field in fields(text).filter(|field| !field.is_empty()) {
                numbers.push(real(field).filter(|value| value.is_finite()).ok_or_else(|| {
                    let message = format!("*ELASTIC: expected numbers, found `{}`", excerpt(text));
                    vec![deck.at(card, line, Code::DeckSyntax, message).with_help("correct the line")]
                })?);
            }
        }
    }
    if numbers.len() < form.n_numbers() {
        let message = format!("*ELASTIC: expected {} numbers, found {}", form.n_numbers(), numbers.len());
        return Err(vec![
            deck.about(elastic, Code::DeckSyntax, message).with_help("write all constants of the type"),
        ]);
    }
    Ok(form.elasticity(&numbers).ok_or_else(|| "its elasticity is not positive definite".to_owned()))
}

/// Form in which an elasticity is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    /// E, nu.
    Isotropic,
    /// E1, E2, E3, nu12, nu13, nu23, G12, G13, G23.
    Constants,
    /// D1111, D1122, D2222, D1133, D2233, D3333, D1212, D1313, D2323.
    Orthotropic,
    /// The constants of [`anisotropic`].
    Anisotropic,
}

impl Form {
    fn of(kind: &str) -> Option<Self> {
        match kind {
            "ISO" | "ISOTROPIC" => Some(Self::Isotropic),
            "ENGINEERINGCONSTANTS" => Some(Self::Constants),
            "ORTHO" | "ORTHOTROPIC" => Some(Self::Orthotropic),
            "ANISO" | "ANISOTROPIC" => Some(Self::Anisotropic),
            _ => None,
        }
    }

    fn n_numbers(self) -> usize {
        match self {
            Self::Isotropic => 2,
            Self::Constants | Self::Orthotropic => 9,
            Self::Anisotropic => ANISOTROPIC_CONSTANTS,
        }
    }

    /// Returns the number of lines of the constants, eight on a line.
    fn n_lines(self) -> usize {
        self.n_numbers().div_ceil(8)
    }

    /// Returns the elasticity by at least [`Self::n_numbers`] numbers; `None` unless it is positive definite.
    fn elasticity(self, numbers: &[f64]) -> Option<Elasticity> {
        match (self, numbers) {
            (Self::Isotropic, &[youngs, poisson, ..]) => Elasticity::isotropic(youngs, poisson),
            (Self::Constants, &[e1, e2, e3, nu12, nu13, nu23, g12, g13, g23, ..]) => {
                Elasticity::orthotropic_constants([e1, e2, e3], [nu12, nu13, nu23], [g12, g13, g23])
            }
            (Self::Orthotropic, &[d1, d12, d2, d13, d23, d3, g12, g13, g23, ..]) => {
                let mut all = [0.0; ANISOTROPIC_CONSTANTS];
                all[..6].copy_from_slice(&[d1, d12, d2, d13, d23, d3]);
                (all[9], all[14], all[20]) = (g12, g13, g23);
                anisotropic(&all)
            }
            (Self::Anisotropic, numbers) => anisotropic(numbers),
            _ => None,
        }
    }
}
