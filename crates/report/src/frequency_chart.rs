//! Quantities over frequency, one panel above the other: inline SVG, readable without colour.

use super::markup::escape;
use super::numbers::significant;
use std::fmt::Write;

/// Places on the drawing, in its own units.
const LEFT: f64 = 92.0;
const WIDTH: f64 = 600.0;
const NAMES: f64 = 148.0;
const TOP: f64 = 24.0;
const BOTTOM: f64 = 34.0;
const GAP: f64 = 30.0;
/// Decades that a logarithmic panel shows at the most: those at its upper end.
const MOST_DECADES: f64 = 10.0;
/// Labels of a logarithmic panel at the most.
const MOST_LABELS: f64 = 6.0;
/// Vertical lines of the grid on a linear axis.
const PARTS: u32 = 5;
/// A jump of the phase, in degrees, that is one from -180 to 180.
const WRAP: f64 = 180.0;

/// The axis that all panels share.
pub(super) struct FrequencyAxis<'a> {
    /// Ascending. Unit: Hz.
    pub hertz: &'a [f64],
    pub logarithmic: bool,
}

/// How values of a panel are drawn.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Scale {
    /// By decades; values that are not positive are left out.
    Logarithmic,
    /// From -180 to 180 degrees.
    Degrees,
}

/// One panel.
pub(super) struct Panel {
    pub caption: String,
    pub scale: Scale,
    pub height: f64,
    pub curves: Vec<Curve>,
    /// A level that is marked.
    pub limit: Option<f64>,
}

/// Values at all frequencies, as a line or, where they are known at some only, as dots.
pub(super) struct Curve {
    pub name: &'static str,
    pub values: Vec<f64>,
    pub dots: bool,
}

/// The panels, one above the other; empty where there is nothing to draw.
pub(super) fn frequency_chart(title: &str, axis: &FrequencyAxis<'_>, panels: &[Panel]) -> String {
    let (Some(&first), Some(&last)) = (axis.hertz.first(), axis.hertz.last()) else { return String::new() };
    if first >= last {
        return String::new();
    }
    let height = TOP + BOTTOM + panels.iter().map(|panel| panel.height + GAP).sum::<f64>() - GAP;
    let title = escape(title);
    let mut svg = format!(
        "<figure><figcaption>{title}</figcaption>\n<svg viewBox=\"0 0 {} {height}\" role=\"img\" aria-label=\"{title} over frequency\">\n",
        LEFT + WIDTH + NAMES
    );
    let mut top = TOP;
    for (number, panel) in panels.iter().enumerate() {
        let drawn = Drawn { axis, ends: [first, last], panel, top, levels: Levels::of(panel) };
        drawn.draw(&mut svg, number + 1 == panels.len());
        top += panel.height + GAP;
    }
    svg.push_str("</svg></figure>\n");
    svg
}

/// Range of a panel, in the scale of its axis, and its lines of the grid.
struct Levels {
    low: f64,
    high: f64,
    step: f64,
}

impl Levels {
    fn of(panel: &Panel) -> Self {
        if panel.scale == Scale::Degrees {
            return Self { low: -180.0, high: 180.0, step: 90.0 };
        }
        let values = panel.curves.iter().flat_map(|curve| &curve.values).chain(&panel.limit);
        let decades = || values.clone().filter(|v| v.is_finite() && **v > 0.0).map(|v| v.log10());
        let high = decades().fold(f64::NEG_INFINITY, f64::max).ceil();
        let low = decades().fold(f64::INFINITY, f64::min).floor();
        if low > high {
            return Self { low: -1.0, high: 0.0, step: 1.0 };
        }
        let low = low.min(high - 1.0).max(high - MOST_DECADES);
        Self { low, high, step: ((high - low) / MOST_LABELS).ceil().max(1.0) }
    }
}

/// A panel at its place.
struct Drawn<'a> {
    axis: &'a FrequencyAxis<'a>,
    ends: [f64; 2],
    panel: &'a Panel,
    top: f64,
    levels: Levels,
}

impl Drawn<'_> {
    fn x(&self, hertz: f64) -> f64 {
        let [first, last] = self.ends;
        let part = match self.axis.logarithmic {
            true => (hertz / first).ln() / (last / first).ln(),
            false => (hertz - first) / (last - first),
        };
        LEFT + WIDTH * part
    }

    /// `None` for what is not drawn; what lies below the panel stands at its lower end.
    fn y(&self, value: f64) -> Option<f64> {
        let at = match self.panel.scale {
            Scale::Logarithmic => value.log10(),
            Scale::Degrees => value,
        };
        let Levels { low, high, .. } = self.levels;
        let part = (at.clamp(low, high) - low) / (high - low);
        at.is_finite().then_some(self.top + self.panel.height * (1.0 - part))
    }

    fn draw(&self, svg: &mut String, last: bool) {
        let caption = escape(&self.panel.caption);
        let _ =
            writeln!(svg, "<text class=\"tick\" x=\"{LEFT}\" y=\"{:.1}\">{caption}</text>", self.top - 7.0);
        self.draw_levels(svg);
        self.draw_frequencies(svg, last);
        if let Some(y) = self.panel.limit.and_then(|limit| self.y(limit)) {
            let _ =
                writeln!(svg, "<polyline class=\"l2\" points=\"{LEFT},{y:.1} {:.1},{y:.1}\"/>", LEFT + WIDTH);
        }
        for (i, curve) in self.panel.curves.iter().enumerate() {
            self.draw_name(svg, i, curve);
            if curve.dots { self.draw_dots(svg, i, curve) } else { self.draw_line(svg, i, curve) }
        }
    }

    fn draw_levels(&self, svg: &mut String) {
        let Levels { low, high, step } = self.levels;
        let mut at = low;
        while at <= high {
            let label = match self.panel.scale {
                Scale::Logarithmic => format!("1e{at}"),
                Scale::Degrees => significant(at, 3),
            };
            let y = self.top + self.panel.height * (high - at) / (high - low);
            let _ = writeln!(
                svg,
                "<line class=\"grid\" x1=\"{LEFT}\" x2=\"{:.1}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/><text class=\"tick\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
                LEFT + WIDTH,
                LEFT - 6.0,
                y + 4.0
            );
            at += step;
        }
    }

    fn draw_frequencies(&self, svg: &mut String, last: bool) {
        let [low, high] = self.ends;
        let at: Vec<f64> = match self.axis.logarithmic {
            true => {
                let decades = low.log10().ceil() as i32..=high.log10().floor() as i32;
                decades.map(|power| 10f64.powi(power)).collect()
            }
            false => (0..=PARTS).map(|i| low + (high - low) * f64::from(i) / f64::from(PARTS)).collect(),
        };
        for hertz in at {
            let x = self.x(hertz);
            let _ = writeln!(
                svg,
                "<line class=\"grid\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{:.1}\" y2=\"{:.1}\"/>",
                self.top,
                self.top + self.panel.height
            );
            if last {
                let y = self.top + self.panel.height + 18.0;
                let label = significant(hertz, 3);
                let _ = writeln!(
                    svg,
                    "<text class=\"tick\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">{label}</text>"
                );
            }
        }
        if last {
            let y = self.top + self.panel.height + 18.0;
            let _ =
                writeln!(svg, "<text class=\"tick\" x=\"{:.1}\" y=\"{y:.1}\">Hz</text>", LEFT + WIDTH + 34.0);
        }
    }

    /// Beside the panel, with the sign of the curve.
    fn draw_name(&self, svg: &mut String, i: usize, curve: &Curve) {
        let (from, y) = (LEFT + WIDTH + 10.0, self.top + 10.0 + 18.0 * i as f64);
        let sign = match curve.dots {
            true => format!("<circle class=\"s{i}\" cx=\"{:.1}\" cy=\"{y:.1}\" r=\"2.6\"/>", from + 11.0),
            false => {
                format!(
                    "<line class=\"l{i}\" x1=\"{from}\" x2=\"{:.1}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>",
                    from + 22.0
                )
            }
        };
        let _ = writeln!(
            svg,
            "{sign}<text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            from + 28.0,
            y + 4.0,
            escape(curve.name)
        );
    }

    fn draw_dots(&self, svg: &mut String, i: usize, curve: &Curve) {
        for (&hertz, &value) in self.axis.hertz.iter().zip(&curve.values) {
            if let Some(y) = self.y(value) {
                let _ = writeln!(
                    svg,
                    "<circle class=\"s{i}\" cx=\"{:.1}\" cy=\"{y:.1}\" r=\"2.2\"/>",
                    self.x(hertz)
                );
            }
        }
    }

    fn draw_line(&self, svg: &mut String, i: usize, curve: &Curve) {
        let mut pieces: Vec<Vec<String>> = vec![Vec::new()];
        let mut before: Option<f64> = None;
        for (&hertz, &value) in self.axis.hertz.iter().zip(&curve.values) {
            let Some(y) = self.y(value) else { continue };
            let wraps =
                self.panel.scale == Scale::Degrees && before.is_some_and(|v| (value - v).abs() > WRAP);
            if wraps {
                pieces.push(Vec::new());
            }
            if let Some(piece) = pieces.last_mut() {
                piece.push(format!("{:.1},{y:.1}", self.x(hertz)));
            }
            before = Some(value);
        }
        for piece in pieces.iter().filter(|piece| piece.len() > 1) {
            let _ = writeln!(svg, "<polyline class=\"l{i}\" points=\"{}\"/>", piece.join(" "));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(scale: Scale, values: Vec<f64>, dots: bool) -> Panel {
        let curves = vec![Curve { name: "a", values, dots }];
        Panel { caption: "c".to_owned(), scale, height: 100.0, curves, limit: None }
    }

    #[test]
    fn a_phase_that_wraps_is_no_line_across_the_panel() {
        let axis = FrequencyAxis { hertz: &[1.0, 2.0, 3.0, 4.0], logarithmic: false };
        let chart =
            frequency_chart("t", &axis, &[panel(Scale::Degrees, vec![-170.0, -175.0, 175.0, 170.0], false)]);
        assert_eq!(chart.matches("<polyline").count(), 2, "{chart}");
    }

    #[test]
    fn what_is_not_known_is_not_drawn() {
        let axis = FrequencyAxis { hertz: &[1.0, 10.0, 100.0], logarithmic: true };
        let values = vec![1.0, f64::NAN, 0.0];
        let chart = frequency_chart("t", &axis, &[panel(Scale::Logarithmic, values, true)]);
        // One dot, and one in the legend.
        assert_eq!(chart.matches("<circle").count(), 2, "{chart}");
        assert!(!chart.contains("NaN") && !chart.contains("inf"), "{chart}");
        assert!(frequency_chart("t", &FrequencyAxis { hertz: &[1.0], logarithmic: false }, &[]).is_empty());
    }
}
