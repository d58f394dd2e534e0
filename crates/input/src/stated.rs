//! Interfaces and damping as a command line, or a caller of the library, states them in one text instead of in tables
//! of a manifest.

use super::model_files::{InterfaceNodes, InterfaceSource, MatrixLocation, Region};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::numbers::parse_ratio;
use flexbody_model::{Coupling, Damping, DampingBand, Reference};

impl InterfaceSource {
    /// Parses `NAME=NODES` or the set `NODES` for both, then a coupling, a reference point or both, each after a comma:
    /// `X/Y/Z` in model axes, or `node:N`. [`InterfaceNodes::parse`] has the forms of the nodes. A plane model
    /// (`dimension` 2) may leave out z.
    ///
    /// ```
    /// use flexbody_input::InterfaceSource;
    /// let bore = InterfaceSource::parse("bore=cylinder:0/0/-1:0/0/1:12.5,rigid,0/0/0", 3).expect("a text");
    /// assert_eq!(bore.name, "bore");
    /// ```
    ///
    /// # Errors
    /// FB801 for an unknown coupling, an invalid region or point, or an empty name.
    pub fn parse(text: &str, dimension: u8) -> Result<Self> {
        let refused = |why: &str, help: &str| {
            let message = format!("interface `{}`: {why}", text.escape_debug());
            Error::from(Diagnostic::new(Code::Usage, message).with_help(help))
        };
        let (mut rest, mut reference, mut coupling) = (text, None, None);
        if let Some((before, last)) = rest.rsplit_once(',')
            && (last.contains('/') || last.trim().starts_with("node:"))
        {
            let stated = match last.trim().strip_prefix("node:") {
                Some(node) => node.trim().parse().ok().map(Reference::Node),
                None => point(last, dimension).map(Reference::Point),
            };
            let known = stated.ok_or_else(|| {
                let help = "write X/Y/Z in model axes and the unit of length of the nodes, or node:N";
                refused(&format!("`{}` is not a point", last.escape_debug()), help)
            })?;
            (rest, reference) = (before, Some(known));
        }
        if let Some((before, last)) = rest.rsplit_once(',') {
            let known = Coupling::from_name(last.trim()).ok_or_else(|| {
                let all = Coupling::NAMES.join(", ");
                let why = format!("`{}` is not a coupling", last.trim().escape_debug());
                refused(&why, &format!("use one of the couplings {all}"))
            })?;
            (rest, coupling) = (before, Some(known));
        }
        let (name, nodes) = rest.split_once('=').unwrap_or((rest, rest));
        if name.is_empty() || nodes.is_empty() || name.chars().any(char::is_control) {
            let why = "expected NAME=NODES, NAME=NODES,COUPLING or NAME=NODES,COUPLING,X/Y/Z";
            return Err(refused(why, "write bore=SET_BORE,rigid,0/0/12.5 or bore=box:0/0/0:10/10/2"));
        }
        let parsed = Self::named(name, nodes, coupling, dimension)?;
        Ok(Self { reference: reference.unwrap_or(parsed.reference), ..parsed })
    }

    /// Creates an interface from its name and the text of its nodes ([`InterfaceNodes::parse`]).
    ///
    /// # Errors
    /// FB801 for invalid nodes.
    pub fn named(name: &str, nodes: &str, coupling: Option<Coupling>, dimension: u8) -> Result<Self> {
        let nodes = InterfaceNodes::parse(nodes, dimension).map_err(|why| {
            let message = format!("interface `{}`: {why}", name.escape_debug());
            Error::from(Diagnostic::new(Code::Usage, message).with_help(InterfaceNodes::FORMS))
        })?;
        let reference = nodes.usual_reference();
        Ok(Self { name: name.to_owned(), nodes, coupling, reference })
    }
}

impl InterfaceNodes {
    /// Forms of [`InterfaceNodes::parse`] as a hint.
    pub const FORMS: &str = "name a node set, or write nodes:1/2/3, file:TABLE.csv, box:X/Y/Z:X/Y/Z (corners), cylinder:X/Y/Z:X/Y/Z:R (ends of the axis, largest radius or least/largest), plane:X/Y/Z:X/Y/Z:WITHIN (point, normal, distance), nearest:X/Y/Z:COUNT";

    /// Parses nodes: the name of a set (after `set:` if it begins like another form), `nodes:1/2/3`, `file:TABLE`, or a
    /// region: `box:`, `cylinder:`, `plane:` and `nearest:` with their values after colons, points as `X/Y/Z`.
    ///
    /// # Errors
    /// The reason in words.
    pub fn parse(text: &str, dimension: u8) -> std::result::Result<Self, String> {
        let Some((kind, values)) = text.split_once(':') else { return Ok(Self::Set(text.to_owned())) };
        let region = match kind {
            "set" => return Ok(Self::Set(values.to_owned())),
            "file" => return Ok(Self::File(values.into())),
            "nodes" => return listed(values),
            "box" | "cylinder" | "plane" | "nearest" => region(kind, values, dimension)?,
            _ => return Ok(Self::Set(text.to_owned())),
        };
        match region.problem() {
            Some(problem) => Err(problem.replace('`', "")),
            None => Ok(Self::Region(region)),
        }
    }

    /// Returns the reference point of an interface that states none.
    pub(super) fn usual_reference(&self) -> Reference {
        match self {
            Self::Region(region) => region.reference(),
            Self::Listed(_) | Self::File(_) | Self::Set(_) => Reference::Centre,
        }
    }
}

/// Parses the node numbers `1/2/3`.
fn listed(values: &str) -> std::result::Result<InterfaceNodes, String> {
    let parsed = values.split('/').map(|number| number.trim().parse::<i64>().ok());
    let nodes: Vec<i64> = parsed
        .collect::<Option<_>>()
        .ok_or_else(|| format!("`{}` are not node numbers as in 1/2/3", values.escape_debug()))?;
    let mut sorted = nodes.clone();
    sorted.sort_unstable();
    match sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(format!("node {} is listed twice", pair[0])),
        None => Ok(InterfaceNodes::Listed(nodes)),
    }
}

/// Parses the values of a region.
fn region(kind: &str, values: &str, dimension: u8) -> std::result::Result<Region, String> {
    let parts: Vec<&str> = values.split(':').collect();
    let invalid = |what: &str| format!("`{kind}:{}` has no {what}", values.escape_debug());
    let place = |at: usize, what: &str| {
        parts.get(at).and_then(|text| point(text, dimension)).ok_or_else(|| invalid(what))
    };
    let length = |at: usize, what: &str| {
        let length = parts.get(at).and_then(|text| finite(text)).filter(|length| *length >= 0.0);
        length.ok_or_else(|| invalid(what))
    };
    let most = if kind == "box" || kind == "nearest" { 2 } else { 3 };
    if parts.len() > most {
        return Err(format!("`{kind}:{}` has more than {most} values", values.escape_debug()));
    }
    Ok(match kind {
        "box" => Region::Box {
            min: place(0, "point with its smallest coordinates")?,
            max: place(1, "point with its largest coordinates")?,
        },
        "cylinder" => Region::Cylinder {
            from: place(0, "point at one end of its axis")?,
            to: place(1, "point at the other end of its axis")?,
            radius: parts.get(2).and_then(|text| radius(text)).ok_or_else(|| invalid("radius"))?,
        },
        "plane" => Region::Plane {
            point: place(0, "point")?,
            normal: place(1, "normal")?,
            within: length(2, "largest distance")?,
        },
        _ => Region::Nearest {
            point: place(0, "point")?,
            count: match parts.get(1) {
                None => 1,
                Some(text) => {
                    let count = text.trim().parse().ok().filter(|count| *count > 0);
                    count.ok_or_else(|| invalid("number of nodes"))?
                }
            },
        },
    })
}

/// Parses the largest distance from an axis, or the smallest and the largest as in `4/5`.
fn radius(text: &str) -> Option<[f64; 2]> {
    let given: Vec<f64> = text.split('/').map(finite).collect::<Option<_>>()?;
    let (least, largest) = match *given.as_slice() {
        [largest] => (0.0, largest),
        [least, largest] => (least, largest),
        _ => return None,
    };
    (0.0 <= least && least <= largest).then_some([least, largest])
}

/// Parses the point `X/Y/Z`, in a plane model also `X/Y`.
fn point(text: &str, dimension: u8) -> Option<[f64; 3]> {
    let numbers: Vec<f64> = text.split('/').map(finite).collect::<Option<_>>()?;
    match *numbers.as_slice() {
        [x, y, z] => Some([x, y, z]),
        [x, y] if dimension == 2 => Some([x, y, 0.0]),
        _ => None,
    }
}

fn finite(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|value: &f64| value.is_finite())
}

/// Parses damping: a ratio of every mode, `rayleigh=ALPHA,BETA`, `bands=HZ:RATIO,...,RATIO` with ascending ends, or
/// `matrix=FILE`.
///
/// # Errors
/// FB801 for another text or invalid numbers.
pub fn parse_damping(text: &str) -> Result<Damping<MatrixLocation>> {
    let refused = |why: &str| {
        let message = format!("damping `{}`: {why}", text.escape_debug());
        Error::from(Diagnostic::new(Code::Usage, message).with_help(
            "give the ratio of every mode as in 0.02 or 2%, rayleigh=ALPHA,BETA, bands=100:0.01,1000:0.1,1 or matrix=FILE",
        ))
    };
    let numbers = |values: &str| {
        values.split(',').map(|number| number.trim().parse().ok()).collect::<Option<Vec<f64>>>()
    };
    let damping = match text.split_once('=') {
        None => parse_ratio(text).map(Damping::Ratio),
        Some(("rayleigh", values)) => match numbers(values).as_deref() {
            Some(&[alpha, beta]) => Some(Damping::Rayleigh { alpha, beta }),
            _ => None,
        },
        Some(("bands", values)) => values.split(',').map(band).collect::<Option<_>>().map(Damping::Bands),
        Some(("matrix", path)) if !path.is_empty() => Some(Damping::Matrix(MatrixLocation::parse(path))),
        Some(_) => None,
    };
    let damping = damping.ok_or_else(|| refused("expected a ratio, rayleigh=, bands= or matrix="))?;
    match damping.problem() {
        Some(problem) => Err(refused(&problem)),
        None => Ok(damping),
    }
}

/// Parses a band of damping, `HZ:RATIO` or the ratio of the last one.
fn band(text: &str) -> Option<DampingBand> {
    let (to_hz, ratio) = match text.split_once(':') {
        Some((end, ratio)) => (end.trim().parse().ok()?, ratio),
        None => (f64::INFINITY, text),
    };
    Some(DampingBand { to_hz, ratio: parse_ratio(ratio)? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_of_interfaces_are_read_as_their_tables_are() {
        let parsed = |text: &str| InterfaceSource::parse(text, 3).expect(text);
        let bore = parsed("bore=cylinder:0/0/-1:0/0/1:4/5,rigid,0/1/2");
        let wanted = Region::Cylinder { from: [0.0, 0.0, -1.0], to: [0.0, 0.0, 1.0], radius: [4.0, 5.0] };
        assert_eq!(bore.nodes, InterfaceNodes::Region(wanted));
        assert_eq!(
            (bore.coupling, bore.reference),
            (Some(Coupling::Rigid), Reference::Point([0.0, 1.0, 2.0]))
        );
        let axis = Reference::Axis { point: [0.0, 0.0, -1.0], direction: [0.0, 0.0, 2.0] };
        assert_eq!(parsed("bore=cylinder:0/0/-1:0/0/1:5").reference, axis, "as a manifest has it");
        assert_eq!(parsed("EDGE").nodes, InterfaceNodes::Set("EDGE".to_owned()));
        assert_eq!(parsed("e=set:box:1").nodes, InterfaceNodes::Set("box:1".to_owned()));
        assert_eq!(parsed("e=nodes:3/1").nodes, InterfaceNodes::Listed(vec![3, 1]));
        let file = parsed("e=file:a/b.csv,averaging,node:17");
        assert_eq!(file.nodes, InterfaceNodes::File("a/b.csv".into()));
        assert_eq!((file.coupling, file.reference), (Some(Coupling::Averaging), Reference::Node(17)));
        let near = InterfaceSource::parse("e=nearest:1/2:4", 2).expect("a plane model");
        assert_eq!(near.nodes, InterfaceNodes::Region(Region::Nearest { point: [1.0, 2.0, 0.0], count: 4 }));
    }

    #[test]
    fn texts_that_are_no_interface_are_refused() {
        for text in [
            "=SET",
            "a=",
            "a=SET,stiff",
            "a=SET,1/2",
            "a=SET,node:x",
            "a=nodes:1/1",
            "a=nodes:1,2",
            "a=nodes:",
            "a=box:0/0/0",
            "a=box:1/0/0:0/1/1",
            "a=box:0/0/0:1/1/1:2",
            "a=cylinder:0/0/0:0/0/0:1",
            "a=cylinder:0/0/0:0/0/1:5/4",
            "a=plane:0/0/0:0/0/0:1",
            "a=plane:0/0/0:0/0/1:-1",
            "a=nearest:0/0/nan",
            "a=nearest:0/0/0:0",
            "a\u{7}=SET",
        ] {
            let error = InterfaceSource::parse(text, 3).expect_err(text);
            assert!(error.has(Code::Usage), "{text}");
        }
    }

    #[test]
    fn texts_of_damping_are_read_as_their_tables_are() {
        let band = |to_hz, ratio| DampingBand { to_hz, ratio };
        assert_eq!(parse_damping("0.02").expect("a ratio"), Damping::Ratio(0.02));
        assert_eq!(parse_damping("2%").expect("a ratio"), Damping::Ratio(0.02));
        assert_eq!(
            parse_damping("bands=100:1%,1").expect("bands"),
            parse_damping("bands=100:0.01,1").expect("bands")
        );
        let rayleigh = Damping::Rayleigh { alpha: 1.5, beta: 2e-6 };
        assert_eq!(parse_damping("rayleigh=1.5, 2e-6").expect("factors"), rayleigh);
        let bands = Damping::Bands(vec![band(100.0, 0.01), band(f64::INFINITY, 1.0)]);
        assert_eq!(parse_damping("bands=100:0.01,1").expect("bands"), bands);
        let matrix = Damping::Matrix(MatrixLocation::parse("D.h5:/D"));
        assert_eq!(parse_damping("matrix=D.h5:/D").expect("a file"), matrix);
        for text in ["-1", "nan", "two", "rayleigh=1", "bands=1,100:1", "bands=", "matrix=", "modal=1", ""] {
            assert!(parse_damping(text).expect_err(text).has(Code::Usage), "{text}");
        }
    }
}
