//! Charts of reports: inline SVG, readable without colour and without scripts.

mod bars;

use crate::html::{Plain, raised};
use crate::numbers::significant;
use maud::{Markup, Render, html};

pub(crate) use bars::{Bar, Bars, Cells, DECADES, STEPS, colour_scale, step};

/// Layout of the drawing in its own units: labels of the vertical axis, panels, names of the series (at least).
const LEFT: f64 = 92.0;
const WIDTH: f64 = 600.0;
const NAMES: f64 = 196.0;
const TOP: f64 = 24.0;
const BOTTOM: f64 = 52.0;
/// Distance between two panels.
const GAP: f64 = 30.0;
/// Distance between two names in the legend.
const NAME: f64 = 18.0;
/// Space before a name in the legend, for its line, and width of a character, somewhat more than that of most fonts.
const BEFORE_NAME: f64 = 38.0;
const CHARACTER: f64 = 7.0;
/// Half the size of a mark.
const MARK: f64 = 4.0;
/// Number of columns that the points of a line are reduced to; a screen cannot resolve more.
const COLUMNS: usize = 600;
/// Number of lines and colours in the style sheet.
pub(crate) const STYLES: usize = 3;

/// Panels with a common horizontal axis, one above the other.
pub(crate) struct Chart {
    pub title: String,
    pub x: Axis,
    pub panels: Vec<Panel>,
}

/// Series over a common vertical axis.
pub(crate) struct Panel {
    pub caption: String,
    pub y: Axis,
    pub height: f64,
    pub series: Vec<Series>,
}

/// Points of one kind.
pub(crate) struct Series {
    /// Name in the legend; a series with an empty name has no legend entry.
    pub name: String,
    pub mark: Mark,
    /// Number of the line and colour in the style sheet.
    pub style: usize,
    pub points: Vec<[f64; 2]>,
    /// Texts shown when the pointer is over a point; empty for none.
    pub titles: Vec<String>,
}

impl Series {
    /// Returns a series of points without titles.
    pub(crate) fn new(name: &str, mark: Mark, style: usize, points: Vec<[f64; 2]>) -> Self {
        Self { name: name.to_owned(), mark, style: style % STYLES, points, titles: Vec::new() }
    }
}

/// Drawing style of the points of a series. Most of the styles are used by trade studies only, which need
/// HDF5.
#[cfg_attr(not(feature = "hdf5"), allow(dead_code))]
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Mark {
    /// A line through the points.
    Line,
    /// A line that is interrupted where an angle jumps from -180 to 180 degrees.
    Angle,
    Dot,
    Disc,
    Square,
    Triangle,
    Circle,
    /// A ring around a point of another series.
    Ring,
}

/// A coordinate, written with the digits that a drawing needs.
pub(super) struct At(pub f64);

impl Render for At {
    fn render_to(&self, buffer: &mut String) {
        format!("{:.1}", self.0).render_to(buffer);
    }
}

/// Returns an SVG line of a class.
pub(super) fn segment(class: &str, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2]) -> Markup {
    html! { line class=(class) x1=(At(x1)) y1=(At(y1)) x2=(At(x2)) y2=(At(y2)) {} }
}

/// Returns a label with the given anchor: `start`, `middle` or `end`.
pub(super) fn label(class: &str, anchor: &str, [x, y]: [f64; 2], text: &str) -> Markup {
    html! { text class=(class) x=(At(x)) y=(At(y)) text-anchor=(anchor) { (Plain(text)) } }
}

impl Render for Chart {
    fn render(&self) -> Markup {
        let heights: f64 = self.panels.iter().map(|panel| panel.height + GAP).sum();
        let size = format!("0 0 {} {}", LEFT + WIDTH + self.legend_width(), TOP + heights - GAP + BOTTOM);
        let mut top = TOP;
        let placed: Vec<Placed<'_>> = self
            .panels
            .iter()
            .map(|panel| {
                let own = Placed { x: &self.x, panel, top };
                top += panel.height + GAP;
                own
            })
            .collect();
        html! {
            figure {
                figcaption { (Plain(&self.title)) }
                svg viewBox=(size) role="img" aria-label=(Plain(&self.title)) {
                    @for panel in &placed { (panel.grid()) (panel.series()) (panel.legend()) "\n" }
                    @if let Some(last) = placed.last() { (last.below()) }
                }
            }
        }
    }
}

impl Chart {
    /// Returns the width of the legends, in which the longest name fits.
    fn legend_width(&self) -> f64 {
        let names =
            self.panels.iter().flat_map(|panel| &panel.series).map(|series| series.name.chars().count());
        NAMES.max(BEFORE_NAME + CHARACTER * names.max().unwrap_or(0) as f64)
    }
}

/// A panel with its position in the chart.
struct Placed<'c> {
    x: &'c Axis,
    panel: &'c Panel,
    top: f64,
}

impl Placed<'_> {
    fn bottom(&self) -> f64 {
        self.top + self.panel.height
    }

    fn place(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let (across, up) = (self.x.at(x)?, self.panel.y.at(y)?);
        Some([LEFT + WIDTH * across, self.top + self.panel.height * (1.0 - up)])
    }

    fn grid(&self) -> Markup {
        let (top, bottom) = (self.top, self.bottom());
        html! {
            (label("tick", "start", [LEFT, top - 7.0], &self.panel.caption))
            @for (up, text) in self.panel.y.ticks() {
                @let y = top + self.panel.height * (1.0 - up);
                (segment("grid", [LEFT, y], [LEFT + WIDTH, y]))
                (label("tick", "end", [LEFT - 6.0, y + 4.0], text))
            }
            @for (across, _) in self.x.ticks() {
                @let x = LEFT + WIDTH * across;
                (segment("grid", [x, top], [x, bottom]))
            }
            @let middle = format!("translate(14 {:.1}) rotate(-90)", 0.5 * (top + bottom));
            text class="tick" transform=(middle) text-anchor="middle" { (Plain(&raised(&self.panel.y.label))) }
        }
    }

    /// Draws the labels of the horizontal axis below the panel.
    fn below(&self) -> Markup {
        let y = self.bottom();
        html! {
            @for (across, text) in self.x.ticks() {
                (label("tick", "middle", [LEFT + WIDTH * across, y + 18.0], text))
            }
            (label("tick", "middle", [LEFT + 0.5 * WIDTH, y + 40.0], &self.x.label))
        }
    }

    fn series(&self) -> Markup {
        html! {
            @for series in &self.panel.series {
                @if matches!(series.mark, Mark::Line | Mark::Angle) {
                    @for piece in pieces(&series.points, series.mark).filter(|piece| piece.len() > 1) {
                        (self.line(series.style, piece))
                    }
                } @else {
                    @for (i, point) in series.points.iter().enumerate() {
                        @if let Some(at) = self.place(*point) {
                            (mark(series, at, series.titles.get(i)))
                        }
                    }
                }
            }
        }
    }

    fn line(&self, style: usize, points: &[[f64; 2]]) -> Markup {
        let places = gathered(points).into_iter().filter_map(|point| self.place(point));
        let places: Vec<String> = places.map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        html! { polyline class={ "l" (style) } points=(places.join(" ")) {} }
    }

    /// Draws the names of the series beside the panel, each behind its mark.
    fn legend(&self) -> Markup {
        let from = LEFT + WIDTH + 10.0;
        let named =
            self.panel.series.iter().filter(|series| !series.name.is_empty() && !series.points.is_empty());
        html! {
            @for (i, series) in named.enumerate() {
                @let y = self.top + 12.0 + NAME * i as f64;
                @if matches!(series.mark, Mark::Line | Mark::Angle) {
                    (segment(&format!("l{}", series.style), [from, y], [from + 22.0, y]))
                } @else {
                    (mark(series, [from + 11.0, y], None))
                }
                (label("", "start", [from + BEFORE_NAME - 10.0, y + 4.0], &series.name))
            }
        }
    }
}

/// Draws the mark of a point, by shape and colour.
fn mark(series: &Series, [x, y]: [f64; 2], title: Option<&String>) -> Markup {
    let style = series.style;
    let title = html! { @if let Some(title) = title { title { (Plain(title)) } } };
    let disc = |radius: f64| {
        html! { circle class={ "s" (style) } cx=(At(x)) cy=(At(y)) r=(radius) { (title) } }
    };
    match series.mark {
        Mark::Line | Mark::Angle | Mark::Dot => disc(2.4),
        Mark::Disc => disc(MARK),
        Mark::Square => html! {
            rect class={ "s" (style) } x=(At(x - MARK)) y=(At(y - MARK)) width=(2.0 * MARK) height=(2.0 * MARK) { (title) }
        },
        Mark::Triangle => {
            let path = format!("M{x:.1} {:.1}l{MARK} {}h-{}z", y - MARK, 2.0 * MARK, 2.0 * MARK);
            html! { path class={ "s" (style) } d=(path) { (title) } }
        }
        Mark::Circle => {
            html! { circle class={ "l" (style) } cx=(At(x)) cy=(At(y)) r=(MARK + 1.5) { (title) } }
        }
        Mark::Ring => html! { circle class="ring" cx=(At(x)) cy=(At(y)) r="8" { (title) } },
    }
}

/// Splits a line into pieces; lines of angles are split where the angle jumps from one end of the circle to
/// the other.
fn pieces(points: &[[f64; 2]], mark: Mark) -> impl Iterator<Item = &[[f64; 2]]> {
    points.chunk_by(move |a, b| mark != Mark::Angle || (b[1] - a[1]).abs() <= 180.0)
}

/// Returns the finite points of a line. If there are many, keeps only the smallest and the largest value of
/// each column.
fn gathered(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let all: Vec<[f64; 2]> = points.iter().copied().filter(|[_, value]| value.is_finite()).collect();
    let size = all.len().div_ceil(COLUMNS);
    if size <= 2 {
        return all;
    }
    let mut kept = Vec::new();
    for column in all.chunks(size) {
        let by = |better: fn(f64, f64) -> bool| {
            (1..column.len()).fold(0, |best, i| if better(column[i][1], column[best][1]) { i } else { best })
        };
        let (low, high) = (by(|a, b| a < b), by(|a, b| a > b));
        kept.extend([column[low.min(high)], column[low.max(high)]]);
    }
    kept
}

// Axes of charts: range of values, scale and tick marks.

/// Approximate number of intervals between the ticks of a linear axis; the step is rounded to 1, 2 or 5 times
/// a power of ten.
const INTERVALS: f64 = 4.0;
/// Largest number of labels of a logarithmic axis; more labels would overlap on the smallest panel.
const MOST_LABELS: f64 = 7.0;
/// Number of decades below which the multiples 2 and 5 of powers of ten are labelled as well.
const FEW_DECADES: f64 = 2.0;

/// Scale of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scale {
    /// Equal steps for equal differences.
    Linear,
    /// Equal steps for equal ratios; values that are not positive are not drawn.
    Logarithmic,
}

impl Scale {
    fn of(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Logarithmic => value.log10(),
        }
    }
}

/// Range of values with its ticks.
#[derive(Debug, Clone)]
pub(crate) struct Axis {
    /// Quantity or unit shown beside the axis.
    pub label: String,
    scale: Scale,
    ends: [f64; 2],
    ticks: Vec<(f64, String)>,
}

impl Axis {
    /// Returns the linear axis between round values around all `values`; `None` if no value is finite.
    pub(crate) fn around(label: &str, values: impl Iterator<Item = f64>) -> Option<Self> {
        let finite = values.filter(|value| value.is_finite());
        let (mut low, mut high) = finite
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        if low > high {
            return None;
        }
        if low == high {
            let margin = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
            (low, high) = (low - margin, high + margin);
        }
        let step = round_step((high - low) / INTERVALS);
        let (first, last) = ((low / step).floor(), (high / step).ceil());
        let marked = (0..=(last - first) as usize).map(|i| (first + i as f64) * step);
        Some(Self::new(label, Scale::Linear, [first * step, last * step], marked))
    }

    /// Returns the axis from the first to the last value; `None` if the range is empty.
    pub(crate) fn between(label: &str, scale: Scale, ends: [f64; 2]) -> Option<Self> {
        let [low, high] = ends.map(|end| scale.of(end));
        if !(low.is_finite() && high.is_finite() && low < high) {
            return None;
        }
        let marked: Vec<f64> = match scale {
            Scale::Linear => {
                (0..=INTERVALS as u32).map(|i| low + (high - low) * f64::from(i) / INTERVALS).collect()
            }
            Scale::Logarithmic => {
                let factors = if high - low < FEW_DECADES { &[1.0, 2.0, 5.0][..] } else { &[1.0] };
                let powers = (low.floor() as i32..=high.floor() as i32).map(|power| 10f64.powi(power));
                let all = powers.flat_map(|power| factors.iter().map(move |factor| factor * power));
                all.filter(|value| (ends[0]..=ends[1]).contains(value)).collect()
            }
        };
        Some(Self::new(label, scale, ends, marked.into_iter()))
    }

    /// Returns the logarithmic axis over whole decades around all positive `values`, limited to the `most`
    /// highest decades; `None` without a positive value.
    pub(crate) fn decades(label: &str, values: impl Iterator<Item = f64>, most: f64) -> Option<Self> {
        let positive = values.filter(|value| *value > 0.0 && value.is_finite()).map(f64::log10);
        let (low, high) = positive.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), power| {
            (low.min(power.floor()), high.max(power.ceil()))
        });
        if low > high {
            return None;
        }
        let high = high.min(f64::from(f64::MAX_10_EXP));
        let low = low.min(high - 1.0).max(high - most);
        let step = ((high - low) / MOST_LABELS).ceil() as usize;
        let marked = (0..=(high - low) as usize).step_by(step).map(|i| 10f64.powi(low as i32 + i as i32));
        Some(Self::new(label, Scale::Logarithmic, [low, high].map(|power| 10f64.powi(power as i32)), marked))
    }

    /// Returns the axis of angles from -180 to 180 degrees.
    pub(crate) fn degrees() -> Self {
        let marked = (-2..=2).map(|quarter| 90.0 * f64::from(quarter));
        Self::new("degrees", Scale::Linear, [-180.0, 180.0], marked)
    }

    fn new(label: &str, scale: Scale, ends: [f64; 2], marked: impl Iterator<Item = f64>) -> Self {
        let ticks = marked.map(|value| (value, significant(value, 4))).collect();
        Self { label: label.to_owned(), scale, ends, ticks }
    }

    /// Returns the axis with other tick labels.
    pub(crate) fn with_labels(mut self, label: impl Fn(f64) -> String) -> Self {
        self.ticks.iter_mut().for_each(|(value, text)| *text = label(*value));
        self
    }

    /// Returns the first and the last value.
    #[cfg(feature = "hdf5")]
    pub(crate) fn ends(&self) -> [f64; 2] {
        self.ends
    }

    /// Returns the position of a value on the axis, from 0 to 1; a value beyond an end is placed at that end.
    /// `None` for a value that the scale cannot show.
    pub(crate) fn at(&self, value: f64) -> Option<f64> {
        let [low, high] = self.ends.map(|end| self.scale.of(end));
        let at = self.scale.of(value);
        at.is_finite().then(|| (at.clamp(low, high) - low) / (high - low))
    }

    /// Returns positions and labels of the ticks.
    pub(crate) fn ticks(&self) -> impl Iterator<Item = (f64, &str)> {
        self.ticks.iter().filter_map(|(value, label)| Some((self.at(*value)?, label.as_str())))
    }
}

/// Returns the smallest of 1, 2 and 5 times a power of ten that is not below `step`.
fn round_step(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    let round = [1.0, 2.0, 5.0, 10.0].into_iter().find(|factor| factor * power >= step * (1.0 - 1e-12));
    round.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(y: Axis, mark: Mark, points: Vec<[f64; 2]>) -> String {
        let x =
            Axis::between("Hz", Scale::Linear, [points[0][0], points[points.len() - 1][0]]).expect("a range");
        let mut series = Series::new("a <name>", mark, 0, points);
        series.titles.push("<b>".to_owned());
        let panel = Panel { caption: String::new(), y, height: 100.0, series: vec![series] };
        Chart { title: "t".to_owned(), x, panels: vec![panel] }.render().into_string()
    }

    #[test]
    fn gathered_lines_keep_their_peaks() {
        let mut points: Vec<[f64; 2]> = (0..100_000).map(|i| [f64::from(i), 0.0]).collect();
        (points[54_321][1], points[54_330][1]) = (7.0, -3.0);
        let kept = gathered(&points);
        assert!(kept.len() <= 2 * COLUMNS);
        for value in [7.0, -3.0] {
            assert!(kept.iter().any(|point| point[1] == value));
        }
        assert!(kept.is_sorted_by(|a, b| a[0] <= b[0]));
    }

    #[test]
    fn the_longest_name_of_the_legend_fits_the_drawing() {
        let width = |name: &str| {
            let series = Series::new(name, Mark::Line, 0, vec![[1.0, 1.0]]);
            let y = Axis::around("", [0.1, 0.9].into_iter()).expect("a range");
            let panel = Panel { caption: String::new(), y, height: 100.0, series: vec![series] };
            let x = Axis::between("", Scale::Linear, [0.0, 2.0]).expect("a range");
            Chart { title: String::new(), x, panels: vec![panel] }.legend_width()
        };
        assert_eq!(width("x"), NAMES);
        assert!(width("kinetic without flight") >= BEFORE_NAME + 22.0 * CHARACTER);
        assert!(width(&"long ".repeat(10)) > 300.0);
    }

    #[test]
    fn a_phase_that_wraps_is_no_line_across_the_panel() {
        let points = vec![[1.0, -170.0], [2.0, -175.0], [3.0, 175.0], [4.0, 170.0]];
        let chart = drawn(Axis::degrees(), Mark::Angle, points);
        assert_eq!(chart.matches("<polyline").count(), 2, "{chart}");
    }

    #[test]
    fn points_stand_where_their_values_are_and_unknown_ones_nowhere() {
        let y = || Axis::decades("", [1e-2, 1.0].into_iter(), 9.0).expect("a range");
        let chart = drawn(y(), Mark::Disc, vec![[1.0, 1.0], [2.0, f64::NAN], [3.0, 0.0], [5.0, 1e-3]]);
        // The chart has two points, and one mark in the legend.
        assert_eq!(chart.matches("<circle").count(), 3, "{chart}");
        assert!(chart.contains(&format!("cx=\"{LEFT:.1}\" cy=\"{TOP:.1}\"")), "{chart}");
        assert!(chart.contains(&format!("cx=\"{:.1}\" cy=\"{:.1}\"", LEFT + WIDTH, TOP + 100.0)), "{chart}");
        assert!(!chart.contains("NaN") && !chart.contains("inf"), "{chart}");
        assert!(
            chart.contains("&lt;b&gt;") && !chart.contains("<b>") && !chart.contains("<name>"),
            "{chart}"
        );
    }

    fn labels(axis: Option<Axis>) -> String {
        axis.expect("a range").ticks().map(|(_, label)| label.to_owned()).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn marked_values_are_round() {
        for (step, round) in [(0.013, 0.02), (1.0, 1.0), (2.1e5, 5e5), (7e-12, 1e-11)] {
            assert!((round_step(step) / round - 1.0).abs() < 1e-12, "{step}");
        }
        assert_eq!(labels(Axis::around("", [0.1, 0.9].into_iter())), "0 0.2 0.4 0.6 0.8 1");
        assert_eq!(labels(Axis::decades("", [0.02, 30.0].into_iter(), 9.0)), "0.01 0.1 1 10 100");
        assert_eq!(labels(Axis::between("", Scale::Logarithmic, [3.0, 5000.0])), "10 100 1000");
        assert_eq!(labels(Axis::between("", Scale::Logarithmic, [300.0, 900.0])), "500");
        assert_eq!(labels(Axis::between("", Scale::Linear, [0.0, 2.0])), "0 0.5 1 1.5 2");
    }

    #[test]
    fn a_value_without_a_place_is_none() {
        let axis = Axis::decades("", [1e-2, 1.0].into_iter(), 9.0).expect("a range");
        assert_eq!([1e-3, 0.1, 5.0].map(|value| axis.at(value)), [Some(0.0), Some(0.5), Some(1.0)]);
        assert_eq!([0.0, -1.0, f64::NAN, f64::INFINITY].map(|value| axis.at(value)), [None; 4]);
        assert!(Axis::around("", [f64::NAN].into_iter()).is_none());
        assert!(Axis::between("", Scale::Linear, [1.0, 1.0]).is_none());
        assert!(Axis::decades("", [0.0].into_iter(), 9.0).is_none());
    }
}
