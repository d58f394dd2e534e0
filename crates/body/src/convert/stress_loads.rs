//! Loads whose stress stiffness is computed.

/// Loads whose stress stiffness is computed from the elements of the deck.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StressLoads {
    /// Centrifugal loads of unit spin.
    pub spin: bool,
    /// Unit forces and moments at interfaces.
    pub interfaces: bool,
    /// Named loads, except preloads, whose stress stiffness belongs to K.
    pub loads: bool,
}

impl StressLoads {
    /// Returns true if no load is wanted.
    pub fn is_empty(self) -> bool {
        self == Self::default()
    }

    /// Names of the kinds of loads, in the order of the documentation.
    pub const NAMES: [&'static str; 3] = ["spin", "interfaces", "loads"];

    /// Returns the kinds of loads with the given names, separated by commas: `none` and an empty text are no loads.
    ///
    /// # Errors
    /// The first name that is not known.
    pub fn parse(text: &str) -> std::result::Result<Self, String> {
        let mut wanted = Self::default();
        for name in text.split(',').map(str::trim).filter(|name| !name.is_empty() && *name != "none") {
            match name {
                "spin" => wanted.spin = true,
                "interfaces" => wanted.interfaces = true,
                "loads" => wanted.loads = true,
                _ => return Err(name.to_owned()),
            }
        }
        Ok(wanted)
    }

    /// Returns the kinds of loads that the settings of a body record.
    pub fn recorded(settings: &serde_json::Value) -> Self {
        let names = settings["stress_stiffness"].as_array().into_iter().flatten();
        let names: Vec<&str> = names.filter_map(serde_json::Value::as_str).collect();
        Self::parse(&names.join(",")).unwrap_or_default()
    }

    /// Returns the names of the kinds of loads that are wanted.
    pub fn names(self) -> Vec<&'static str> {
        let kinds = [self.spin, self.interfaces, self.loads];
        Self::NAMES.into_iter().zip(kinds).filter(|(_, wanted)| *wanted).map(|(name, _)| name).collect()
    }
}
