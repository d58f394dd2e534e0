//! Charts of series: panels with a common horizontal axis.

use super::axis::Axis;
use super::svg::{At, STYLES, label, segment};
use crate::notation::markup::{Plain, raised};
use maud::{Markup, Render, html};

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
/// HDF5, and dots by frequency responses.
#[cfg_attr(not(all(feature = "hdf5", feature = "response")), allow(dead_code))]
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

#[cfg(test)]
mod tests {
    use super::super::axis::Scale;
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
}
