//! The places that the feet of the carriage stood at, and the lines that they lie on.

use runout_core::{Error, ErrorKind, Result, points::Points};

/// Two places are one where they are apart by less than this share of the shortest step.
const SAME_PLACE: f64 = 0.02;

/// Steps of the carriage between nodes.
pub(crate) struct Steps {
    /// Places of the nodes, in mm.
    pub nodes_mm: Vec<[f64; 2]>,
    /// Of each reading, the nodes of the rear and of the front foot.
    pub feet: Vec<[usize; 2]>,
    /// Distance of the feet, in mm.
    pub length_mm: Vec<f64>,
    /// Line of each reading, an index into `lines`, and its place among the readings of that line.
    pub line: Vec<usize>,
    pub step: Vec<usize>,
    pub lines: Vec<String>,
    pub slope_urad: Vec<f64>,
}

impl Steps {
    /// # Errors
    /// Where both feet stand at one place.
    pub(crate) fn of(points: &Points) -> Result<Self> {
        let column = |name: &str| points.column(name);
        let [x0, y0, x1, y1] = [column("from_x_mm")?, column("from_y_mm")?, column("to_x_mm")?, column("to_y_mm")?];
        let length_mm: Vec<f64> = (0..x0.len()).map(|row| (x1[row] - x0[row]).hypot(y1[row] - y0[row])).collect();
        if length_mm.is_empty() {
            return Err(refuse(points, "there is no reading".into()));
        }
        if let Some(row) = length_mm.iter().position(|length| *length <= 0.0) {
            return Err(refuse(points, format!("row {}: both feet stand at one place", row + 1)));
        }
        let same_mm = SAME_PLACE * length_mm.iter().copied().fold(f64::INFINITY, f64::min);
        let mut nodes_mm: Vec<[f64; 2]> = Vec::new();
        let mut node = |place: [f64; 2]| {
            let is_near = |known: &[f64; 2]| (known[0] - place[0]).hypot(known[1] - place[1]) < same_mm;
            nodes_mm.iter().position(is_near).unwrap_or_else(|| {
                nodes_mm.push(place);
                nodes_mm.len() - 1
            })
        };
        let feet = (0..x0.len()).map(|row| [node([x0[row], y0[row]]), node([x1[row], y1[row]])]).collect();
        let (mut lines, mut line, mut step): (Vec<String>, Vec<usize>, Vec<usize>) = Default::default();
        for name in points.labels("line").unwrap_or_default() {
            let at = lines.iter().position(|known| known == name).unwrap_or_else(|| {
                lines.push(name.clone());
                lines.len() - 1
            });
            step.push(line.iter().filter(|own| **own == at).count());
            line.push(at);
        }
        Ok(Self { nodes_mm, feet, length_mm, line, step, lines, slope_urad: column("slope_urad")?.to_vec() })
    }

    /// What one unit of a drift from step to step adds to each reading, the same in every line: of time, or of the air along the beam.
    pub(crate) fn drift(&self) -> Vec<f64> {
        self.step.iter().map(|step| *step as f64).collect()
    }

    /// Nodes of a line with their distances along it, in mm, in the direction from the rear to the front foot.
    pub(crate) fn along(&self, line: usize) -> Vec<(f64, usize)> {
        let feet: Vec<[usize; 2]> =
            self.feet.iter().zip(&self.line).filter(|(_, own)| **own == line).map(|(feet, _)| *feet).collect();
        let [rear, front] = feet[0].map(|node| self.nodes_mm[node]);
        let length = (front[0] - rear[0]).hypot(front[1] - rear[1]);
        let place = |node: usize| {
            let [x, y] = self.nodes_mm[node];
            ((x - rear[0]) * (front[0] - rear[0]) + (y - rear[1]) * (front[1] - rear[1])) / length
        };
        let mut nodes: Vec<(f64, usize)> = feet.into_iter().flatten().map(|node| (place(node), node)).collect();
        nodes.sort_by(|a, b| a.0.total_cmp(&b.0));
        nodes.dedup_by_key(|(_, node)| *node);
        nodes.iter().map(|(along, node)| (along - nodes[0].0, *node)).collect()
    }

    /// Three nodes whose heights are taken as 0: slopes do not show the plane, and each line has a zero of its own.
    pub(crate) fn datum(&self, points: &Points) -> Result<[usize; 3]> {
        let farthest = |from: &dyn Fn([f64; 2]) -> f64| {
            (0..self.nodes_mm.len())
                .max_by(|a, b| from(self.nodes_mm[*a]).total_cmp(&from(self.nodes_mm[*b])))
                .unwrap_or(0)
        };
        let distance = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let first = farthest(&|place| distance(place, self.nodes_mm[0]));
        let second = farthest(&|place| distance(place, self.nodes_mm[first]));
        let [a, b] = [self.nodes_mm[first], self.nodes_mm[second]];
        let beside = |place: [f64; 2]| ((b[0] - a[0]) * (place[1] - a[1]) - (b[1] - a[1]) * (place[0] - a[0])).abs();
        let third = farthest(&beside);
        if beside(self.nodes_mm[third]) <= 1e-6 * distance(a, b).powi(2) {
            return Err(refuse(points, "all places lie on one line".into())
                .help("a straightness is that of `as-measured`; a flatness needs lines that cross"));
        }
        Ok([first, second, third])
    }
}

pub(crate) fn refuse(points: &Points, problem: String) -> Error {
    Error::new("evaluate the flatness of", points.input.display().to_string(), problem).of(ErrorKind::InsufficientData)
}
