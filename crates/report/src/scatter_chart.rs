//! Error against cost on logarithmic axes: inline SVG, readable without colour.

use super::markup::escape;
use super::numbers::significant;

/// Places on the drawing, in its own units.
const LEFT: f64 = 92.0;
const WIDTH: f64 = 600.0;
const NAMES: f64 = 148.0;
const TOP: f64 = 12.0;
const HEIGHT: f64 = 330.0;
const BOTTOM: f64 = 52.0;
/// Half the size of a mark.
const MARK: f64 = 4.0;
/// Labels that an axis has at most.
const LABELS: f64 = 9.0;

/// Marks of one kind.
pub(super) struct Series<'a> {
    pub name: &'a str,
    /// What a pointer shows, cost and error.
    pub points: Vec<(String, f64, f64)>,
}

/// What the chart shows besides its marks.
pub(super) struct Chart<'a> {
    pub title: &'a str,
    pub x: &'a str,
    pub y: &'a str,
    /// Points that a line joins.
    pub front: Vec<(f64, f64)>,
    /// The point with a ring.
    pub ring: Option<(f64, f64)>,
    /// Largest cost that is allowed.
    pub most: Option<f64>,
    /// Errors below this stand on the lowest line: they are no errors.
    pub floor: f64,
}

/// A logarithmic axis over whole decades.
struct Axis {
    first: f64,
    decades: f64,
}

impl Axis {
    fn over(values: impl Iterator<Item = f64>) -> Option<Self> {
        let positive = values.filter(|v| *v > 0.0 && v.is_finite());
        let ends =
            positive.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), v| (low.min(v), high.max(v)));
        let (first, last) = (ends.0.log10().floor(), ends.1.log10().ceil());
        (ends.0 <= ends.1).then_some(Self { first, decades: (last - first).max(1.0) })
    }

    /// From 0 to 1.
    fn at(&self, value: f64) -> f64 {
        (value.log10() - self.first) / self.decades
    }

    /// Powers of ten.
    fn labels(&self) -> impl Iterator<Item = f64> + '_ {
        let step = (self.decades / LABELS).ceil() as usize;
        (0..=self.decades as usize).step_by(step).map(|power| 10f64.powf(self.first + power as f64))
    }
}

/// The chart; empty without a point.
pub(super) fn scatter_chart(chart: &Chart<'_>, series: &[Series<'_>]) -> String {
    let raised = |error: f64| error.max(chart.floor);
    let costs = series.iter().flat_map(|s| s.points.iter().map(|p| p.1)).chain(chart.most);
    // The tolerance is always seen.
    let errors = series.iter().flat_map(|s| s.points.iter().map(|p| raised(p.2))).chain([1.0]);
    let (Some(across), Some(up)) = (Axis::over(costs), Axis::over(errors)) else { return String::new() };
    let (width, height) = (LEFT + WIDTH + NAMES, TOP + HEIGHT + BOTTOM);
    let title = escape(chart.title);
    let mut plot = Plot { chart, across, up, svg: String::new() };
    plot.svg.push_str(&format!(
        "<figure><figcaption>{title}</figcaption>\n<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{title}\">\n"
    ));
    plot.grid();
    plot.limits();
    plot.front();
    plot.marks(series);
    plot.ring();
    legend(&mut plot.svg, series, chart.ring.is_some());
    plot.svg.push_str("</svg></figure>\n");
    plot.svg
}

/// A chart that is drawn.
struct Plot<'c> {
    chart: &'c Chart<'c>,
    across: Axis,
    up: Axis,
    svg: String,
}

impl Plot<'_> {
    fn x(&self, cost: f64) -> f64 {
        LEFT + WIDTH * self.across.at(cost)
    }

    fn y(&self, error: f64) -> f64 {
        TOP + HEIGHT * (1.0 - self.up.at(error.max(self.chart.floor)))
    }

    /// Lines of the grid with their numbers, and the names of the axes.
    fn grid(&mut self) {
        for error in self.up.labels() {
            let level = self.y(error);
            self.svg.push_str(&format!(
                "<line class=\"grid\" x1=\"{LEFT}\" x2=\"{:.1}\" y1=\"{level:.1}\" y2=\"{level:.1}\"/><text class=\"tick\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>\n",
                LEFT + WIDTH, LEFT - 6.0, level + 4.0, significant(error, 2)
            ));
        }
        for cost in self.across.labels() {
            let place = self.x(cost);
            self.svg.push_str(&format!(
                "<line class=\"grid\" x1=\"{place:.1}\" x2=\"{place:.1}\" y1=\"{TOP}\" y2=\"{:.1}\"/><text class=\"tick\" x=\"{place:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\n",
                TOP + HEIGHT, TOP + HEIGHT + 18.0, significant(cost, 2)
            ));
        }
        self.svg.push_str(&format!(
            "<text class=\"tick\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text><text class=\"tick\" transform=\"translate(14 {:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
            LEFT + 0.5 * WIDTH, TOP + HEIGHT + 40.0, escape(self.chart.x), TOP + 0.5 * HEIGHT, escape(self.chart.y)
        ));
    }

    /// The tolerance, and the cost that is allowed.
    fn limits(&mut self) {
        let level = self.y(1.0);
        self.svg.push_str(&format!(
            "<polyline class=\"l1\" points=\"{LEFT},{level:.1} {:.1},{level:.1}\"/>\n",
            LEFT + WIDTH
        ));
        if let Some(most) = self.chart.most {
            let place = self.x(most);
            self.svg.push_str(&format!(
                "<polyline class=\"l1\" points=\"{place:.1},{TOP} {place:.1},{:.1}\"/>\n",
                TOP + HEIGHT
            ));
        }
    }

    fn front(&mut self) {
        let corner = |&(cost, error): &(f64, f64)| format!("{:.1},{:.1}", self.x(cost), self.y(error));
        let corners: Vec<String> = self.chart.front.iter().map(corner).collect();
        self.svg.push_str(&format!("<polyline class=\"l0\" points=\"{}\"/>\n", corners.join(" ")));
    }

    fn marks(&mut self, series: &[Series<'_>]) {
        for (style, one) in series.iter().enumerate() {
            for (name, cost, error) in &one.points {
                let mark = mark(style, self.x(*cost), self.y(*error), name);
                self.svg.push_str(&mark);
            }
        }
    }

    fn ring(&mut self) {
        let Some((cost, error)) = self.chart.ring else { return };
        let (x, y) = (self.x(cost), self.y(error));
        self.svg.push_str(&format!(
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"9\" style=\"fill: none; stroke: var(--ink, #1a1d21); stroke-width: 2\"/>\n"
        ));
    }
}

fn legend(svg: &mut String, series: &[Series<'_>], ring: bool) {
    let from = LEFT + WIDTH + 12.0;
    let mut level = TOP + 12.0;
    let mut entry = |drawing: &dyn Fn(f64) -> String, name: &str| {
        let text =
            format!("<text x=\"{:.1}\" y=\"{:.1}\">{}</text>\n", from + 24.0, level + 4.0, escape(name));
        svg.push_str(&(drawing(level) + &text));
        level += 18.0;
    };
    for (style, of) in series.iter().enumerate().filter(|(_, of)| !of.points.is_empty()) {
        entry(&|level| mark(style, from + 9.0, level, of.name), of.name);
    }
    let line = |class: &'static str| {
        move |level: f64| {
            let end = from + 18.0;
            format!("<line class=\"{class}\" x1=\"{from}\" x2=\"{end:.1}\" y1=\"{level}\" y2=\"{level}\"/>")
        }
    };
    entry(&line("l0"), "Pareto front");
    entry(&line("l1"), "what is allowed");
    if ring {
        let circle = |level: f64| {
            format!(
                "<circle cx=\"{:.1}\" cy=\"{level}\" r=\"7\" style=\"fill: none; stroke: var(--ink, #1a1d21); stroke-width: 2\"/>",
                from + 9.0
            )
        };
        entry(&circle, "recommended");
    }
}

/// A mark of a series, by shape and colour: disc, square, triangle, ring.
fn mark(style: usize, x: f64, y: f64, name: &str) -> String {
    let title = format!("<title>{}</title>", escape(name));
    let (half, side) = (MARK, 2.0 * MARK);
    match style % 4 {
        0 => format!("<circle class=\"s0\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{half}\">{title}</circle>\n"),
        1 => format!(
            "<rect class=\"s1\" x=\"{:.1}\" y=\"{:.1}\" width=\"{side}\" height=\"{side}\">{title}</rect>\n",
            x - half,
            y - half
        ),
        2 => format!(
            "<path class=\"s2\" d=\"M{x:.1} {:.1}l{half} {side}h-{side}z\">{title}</path>\n",
            y - half
        ),
        _ => format!(
            "<circle class=\"l0\" style=\"fill: none\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{}\">{title}</circle>\n",
            half + 1.5
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(floor: f64) -> Chart<'static> {
        Chart { title: "t", x: "x", y: "y", front: vec![], ring: None, most: None, floor }
    }

    #[test]
    fn points_stand_where_their_decades_are() {
        let points = vec![("a".to_owned(), 10.0, 1.0), ("b".to_owned(), 1000.0, 0.0)];
        let svg = scatter_chart(&chart(1e-2), &[Series { name: "s", points }]);
        // One decade to two, and from 1e-2, where no error stands, to 1.
        assert!(svg.contains(&format!("cx=\"{:.1}\" cy=\"{:.1}\"", LEFT, TOP)), "{svg}");
        assert!(svg.contains(&format!("cx=\"{:.1}\" cy=\"{:.1}\"", LEFT + WIDTH, TOP + HEIGHT)), "{svg}");
    }

    #[test]
    fn nothing_to_draw_draws_nothing() {
        assert!(scatter_chart(&chart(1e-6), &[Series { name: "s", points: vec![] }]).is_empty());
    }

    #[test]
    fn names_are_text() {
        let points = vec![("<b>".to_owned(), 1.0, 1.0)];
        let svg = scatter_chart(&chart(1e-6), &[Series { name: "s", points }]);
        assert!(svg.contains("&lt;b&gt;") && !svg.contains("<b>"));
    }
}
