//! Quantities over time as lines: inline SVG, readable without colour.

use super::markup::{escape, printed};
use super::numbers::significant;

/// Places on the drawing, in its own units.
const LEFT: f64 = 92.0;
const WIDTH: f64 = 600.0;
const NAMES: f64 = 148.0;
const TOP: f64 = 12.0;
const HEIGHT: f64 = 170.0;
const BOTTOM: f64 = 34.0;
/// Columns that the points of a line are gathered to: no more can be seen.
const COLUMNS: usize = 600;
/// Line styles of the style sheet.
pub(super) const STYLES: usize = 3;
/// Intervals between the lines of the grid.
const INTERVALS: f64 = 4.0;

/// One line: its name and its values.
pub(super) struct Line {
    pub name: String,
    pub values: Vec<f64>,
}

/// Lines over `time`, with the unit of each axis; empty without a finite value.
pub(super) fn line_chart(title: &str, time: &[f64], lines: &[Line], time_unit: &str, unit: &str) -> String {
    let Some(scales) = Scales::over(time, lines) else { return String::new() };
    let (width, height) = (LEFT + WIDTH + NAMES, TOP + HEIGHT + BOTTOM);
    let title = escape(title);
    let mut svg = format!(
        "<figure><figcaption>{title} [{}]</figcaption>\n<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{title} over time\">\n",
        printed(unit)
    );
    scales.draw_levels(&mut svg);
    scales.draw_times(&mut svg, time_unit);
    for (i, line) in lines.iter().enumerate() {
        scales.draw_line(&mut svg, time, i, line);
    }
    svg.push_str("</svg></figure>\n");
    svg
}

/// The ranges of the axes.
struct Scales {
    start: f64,
    end: f64,
    /// Distance of the lines of the grid, and the numbers of the first and the last of them.
    step: f64,
    first: f64,
    last: f64,
}

impl Scales {
    /// `None` without a finite value or an interval of time.
    fn over(time: &[f64], lines: &[Line]) -> Option<Self> {
        let finite = || lines.iter().flat_map(|line| &line.values).copied().filter(|v| v.is_finite());
        let (mut low, mut high) =
            (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
        let (&start, &end) = (time.first()?, time.last()?);
        if low > high || start >= end {
            return None;
        }
        if low == high {
            let margin = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
            (low, high) = (low - margin, high + margin);
        }
        let step = round_step((high - low) / INTERVALS);
        Some(Self { start, end, step, first: (low / step).floor(), last: (high / step).ceil() })
    }

    fn x(&self, time: f64) -> f64 {
        LEFT + WIDTH * (time - self.start) / (self.end - self.start)
    }

    fn y(&self, value: f64) -> f64 {
        let (low, high) = (self.first * self.step, self.last * self.step);
        TOP + HEIGHT * (1.0 - (value - low) / (high - low))
    }

    /// Lines of the grid with their values.
    fn draw_levels(&self, svg: &mut String) {
        let mut at = self.first;
        while at <= self.last {
            let level = self.y(at * self.step);
            svg.push_str(&format!(
                "<line class=\"grid\" x1=\"{LEFT}\" x2=\"{:.1}\" y1=\"{level:.1}\" y2=\"{level:.1}\"/><text class=\"tick\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>\n",
                LEFT + WIDTH, LEFT - 6.0, level + 4.0, significant(at * self.step, 4)
            ));
            at += 1.0;
        }
    }

    /// Times below the drawing, the last with the unit.
    fn draw_times(&self, svg: &mut String, unit: &str) {
        for part in 0..=4 {
            let t = self.start + (self.end - self.start) * f64::from(part) / 4.0;
            let label =
                if part == 4 { format!("{} {}", significant(t, 4), escape(unit)) } else { significant(t, 4) };
            svg.push_str(&format!(
                "<text class=\"tick\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>\n",
                self.x(t),
                TOP + HEIGHT + 18.0
            ));
        }
    }

    /// Line number `i` and its name beside the drawing.
    fn draw_line(&self, svg: &mut String, time: &[f64], i: usize, line: &Line) {
        let point = |(t, v): (f64, f64)| format!("{:.1},{:.1}", self.x(t), self.y(v));
        let points: Vec<String> = gathered(time, &line.values).into_iter().map(point).collect();
        let style = i % STYLES;
        let (from, level) = (LEFT + WIDTH + 10.0, TOP + 12.0 + 18.0 * i as f64);
        svg.push_str(&format!(
            "<polyline class=\"l{style}\" points=\"{}\"/>\n<line class=\"l{style}\" x1=\"{from}\" x2=\"{:.1}\" y1=\"{level}\" y2=\"{level}\"/><text x=\"{:.1}\" y=\"{:.1}\">{}</text>\n",
            points.join(" "), from + 22.0, from + 28.0, level + 4.0, escape(&line.name)
        ));
    }
}

/// The smallest and the largest value of every column, in their order.
fn gathered(time: &[f64], values: &[f64]) -> Vec<(f64, f64)> {
    let all: Vec<(f64, f64)> =
        time.iter().copied().zip(values.iter().copied()).filter(|(_, v)| v.is_finite()).collect();
    let size = all.len().div_ceil(COLUMNS);
    if size <= 2 {
        return all;
    }
    let mut kept = Vec::new();
    for column in all.chunks(size) {
        let by = |better: fn(f64, f64) -> bool| {
            (1..column.len()).fold(0, |best, i| if better(column[i].1, column[best].1) { i } else { best })
        };
        let (low, high) = (by(|a, b| a < b), by(|a, b| a > b));
        kept.push(column[low.min(high)]);
        kept.push(column[low.max(high)]);
    }
    kept
}

/// The next of 1, 2, 5 times a power of ten that is not below `step`.
fn round_step(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    let round = [1.0, 2.0, 5.0, 10.0].into_iter().find(|factor| factor * power >= step * (1.0 - 1e-12));
    round.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_of_the_grid_are_round() {
        for (step, round) in [(0.013, 0.02), (1.0, 1.0), (2.1e5, 5e5), (7e-12, 1e-11)] {
            assert!((round_step(step) / round - 1.0).abs() < 1e-12, "{step}");
        }
    }

    #[test]
    fn gathered_lines_keep_their_peaks() {
        let time: Vec<f64> = (0..100_000).map(f64::from).collect();
        let mut values = vec![0.0; time.len()];
        (values[54_321], values[54_330]) = (7.0, -3.0);
        let kept = gathered(&time, &values);
        assert!(kept.len() <= 2 * COLUMNS);
        for value in [7.0, -3.0] {
            assert!(kept.iter().any(|&(_, v)| v == value));
        }
        assert!(kept.windows(2).all(|pair| pair[0].0 <= pair[1].0));
    }

    #[test]
    fn nothing_to_draw_draws_nothing() {
        let line = |value| [Line { name: "a".to_owned(), values: vec![value; 2] }];
        assert!(line_chart("t", &[0.0, 1.0], &line(f64::NAN), "s", "m").is_empty());
        assert!(line_chart("t", &[0.0, 0.0], &line(1.0), "s", "m").is_empty());
        assert!(line_chart("t", &[0.0, 1.0], &line(0.0), "s", "m").contains("polyline"));
    }
}
