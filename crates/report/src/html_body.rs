//! The head of the report of a body: the part drawn, its mass properties beside it, and what is to be minded.

use super::Facts;
use super::facts::ModelFacts;
use super::glossary::word_as;
use super::markup::{escape, printed, section, table, terms_in_markup, texts};
use super::numbers::{counted, significant};
use flexbody_body::flex_body::{FlexBody, MassStructure};

/// The picture, where there is one, and what is known of the undeformed body.
pub(super) fn body(html: &mut String, facts: &Facts<'_>, panel: Option<&str>) {
    html.push_str(if panel.is_some() { "<div class=\"top\">\n" } else { "<div>\n" });
    html.push_str(panel.unwrap_or_default());
    html.push_str("<div class=\"properties\">\n");
    section(html, "Body");
    terms_in_markup(html, properties(facts));
    html.push_str("</div>\n</div>\n");
    limits(html, &facts.model);
    interfaces(html, facts);
}

/// Three numbers on lines of their own would tear a table apart: they wrap between each other.
fn triple(values: &[f64; 3], unit: &str) -> String {
    let [x, y, z] = values.map(|value| significant(value, 6));
    format!("{x}, &ensp;{y}, &ensp;{z} {}", printed(unit))
}

fn properties(facts: &Facts<'_>) -> Vec<(String, String)> {
    let (model, body) = (&facts.model, &facts.body);
    let units = &model.units;
    let size = body.size();
    let centre = body.centre_of_mass.map(|x| if x.abs() <= 1e-12 * size { 0.0 } else { x });
    let [x, y, z] = body.frame_axes.map(|row| row.map(|v| significant(v, 6)).join(", "));
    let mut items = vec![
        (
            "Mass".to_owned(),
            format!("<strong>{} {}</strong>", significant(body.mass, 7), printed(&units.mass())),
        ),
        ("Centre of mass".to_owned(), format!("{} (model axes)", triple(&centre, &units.length()))),
        (
            word_as("principal moments of inertia", "Principal inertia"),
            format!("{} (about the centre of mass)", triple(&body.principal_inertia, &units.inertia())),
        ),
        (
            word_as("radius of gyration", "Radii of gyration"),
            triple(&body.radii_of_gyration, &units.length()),
        ),
    ];
    if let Some(extent) = extent(facts.flex_body) {
        items.push((
            "Extent of the nodes".to_owned(),
            format!(
                "{} {} (model axes)",
                extent.map(|x| significant(x, 4)).join(" &times; "),
                printed(&units.length())
            ),
        ));
    }
    let plane = if model.dimension == 2 { "; plane model" } else { "" };
    items.push(("Model".to_owned(), format!("{}{plane}", escape(&model.size_in_words()))));
    if let Some(own) = &model.body {
        items.push(("Of several".to_owned(), format!("body {} of {} in the matrices", own.number, own.of)));
    }
    if let Some(mesh) = &model.mesh {
        items.push(("Surface".to_owned(), mesh.in_words()));
    }
    let origin = triple(&body.frame_origin, &units.length());
    items.push(("Body frame".to_owned(), format!("{}; origin {origin}", escape(&body.frame))));
    items.push(("Body axes".to_owned(), format!("columns of [{x}; {y}; {z}]")));
    items.push(("Units".to_owned(), escape(&units.in_words())));
    items
}

/// Sides of the box around the nodes.
fn extent(body: &FlexBody) -> Option<[f64; 3]> {
    let places = body.nodes().positions.iter().map(|x| body.frame().to_model(*x));
    let (low, high) = places.fold(None, |own: Option<([f64; 3], [f64; 3])>, x| {
        let (low, high) = own.unwrap_or((x, x));
        Some(([0, 1, 2].map(|k| low[k].min(x[k])), [0, 1, 2].map(|k| high[k].max(x[k]))))
    })?;
    Some([0, 1, 2].map(|k| high[k] - low[k]))
}

/// What is not exact, of what the body was made of.
fn limits(html: &mut String, model: &ModelFacts) {
    let mut minded = Vec::new();
    if let Some(remark) = &model.approximation {
        minded.push(format!("Approximation: {}.", escape(remark)));
    }
    if model.mass_structure == MassStructure::Diagonal.name() {
        minded.push(
            "The mass matrix is diagonal: it was lumped before it came here, and all numbers are exact for that mass only."
                .to_owned(),
        );
    }
    if let Some(rounded) = model.storage_in_words() {
        minded.push(format!("Rounded: {}.", escape(rounded)));
    }
    if !model.units.stated {
        minded.push("No units were stated: m, kg, s are assumed.".to_owned());
    }
    for remark in minded {
        html.push_str(&format!("<p class=\"mind\">{remark}</p>\n"));
    }
}

fn interfaces(html: &mut String, facts: &Facts<'_>) {
    let model = &facts.model;
    if model.interfaces.is_empty() {
        return;
    }
    let (size, unit) = (facts.body.size(), model.units.length());
    let row = |interface: &super::facts::InterfaceFacts| {
        let words = escape(&interface.in_words(size, &unit));
        let words = match interface.breaks_its_word() {
            true => format!("<span class=\"warning\">{words}</span>"),
            false => words,
        };
        vec![escape(&interface.name), words]
    };
    let rows: Vec<_> = model.interfaces.iter().map(row).collect();
    section(html, &word_as("interface", "Interfaces"));
    let caption = format!("{}, in the order of the file", counted(rows.len(), "interface"));
    table(html, &caption, &texts(["Name", "Nodes, coupling, reference point (model axes)"]), &[0, 1], &rows);
}
