//! Feature parameters (ISO 25178-2:2021, clause 5): hills and dales by watersheds, pruned after Wolf.

use super::HeightMap;

/// Peaks or pits of which the mean is S5p or S5v.
const FIVE: usize = 5;

/// Values of the significant hills and dales. Those that reach an open edge of the map, or a gap, are incomplete and
/// left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Features {
    /// Significant hills.
    pub hills: usize,
    /// Significant dales.
    pub dales: usize,
    /// Density of peaks.
    pub spd_per_mm2: f64,
    /// Density of pits.
    pub svd_per_mm2: f64,
    /// Mean curvature of the peaks, −½ (∂²z/∂x² + ∂²z/∂y²) by second differences.
    pub spc_per_mm: f64,
    /// Mean curvature of the pits, negative.
    pub svc_per_mm: f64,
    /// Mean of the five highest peaks, in µm.
    pub s5p: f64,
    /// Mean of the five deepest pits, in µm.
    pub s5v: f64,
    /// S5p + S5v, in µm.
    pub s10z: f64,
}

impl Features {
    /// Of a map with mean 0; hills and dales lower than `pruning_um` are merged with a neighbour.
    pub(super) fn of(centred: &HeightMap, pruning_um: f64) -> Self {
        let [dales, hills] = [1.0, -1.0].map(|sign| Relief::new(centred, sign).extremes(pruning_um));
        let area = centred.area_mm2();
        let [s5v, s5p] = [&dales, &hills].map(|found| {
            let mut depths: Vec<f64> = found.iter().map(|extreme| -extreme.depth).collect();
            depths.sort_unstable_by(|a, b| b.total_cmp(a));
            mean(depths.into_iter().take(FIVE))
        });
        let [svc_per_mm, spc_per_mm] = [(&dales, -1.0), (&hills, 1.0)]
            .map(|(found, sign)| sign * mean(found.iter().filter_map(|one| one.curvature)));
        Self {
            hills: hills.len(),
            dales: dales.len(),
            spd_per_mm2: hills.len() as f64 / area,
            svd_per_mm2: dales.len() as f64 / area,
            spc_per_mm,
            svc_per_mm,
            s5p,
            s5v,
            s10z: s5p + s5v,
        }
    }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0_usize), |(sum, count), value| (sum + value, count + 1));
    sum / count as f64
}

/// A significant pit (or a peak, on the relief upside down).
struct Extreme {
    depth: f64,
    /// Bluntness of the pit, positive; `None` beside an edge.
    curvature: Option<f64>,
}

/// Heights with a frame of one point, so that every point has eight neighbours: at the open sides, and in gaps, a wall;
/// around a closed map, what is on the other side.
struct Relief<'a> {
    map: &'a HeightMap<'a>,
    heights: Vec<f64>,
    stride: usize,
}

impl<'a> Relief<'a> {
    fn new(map: &'a HeightMap<'a>, sign: f64) -> Self {
        let columns = map.columns();
        let stride = columns + 2;
        let mut heights = vec![f64::INFINITY; (map.rows() + 2) * stride];
        for (row, framed) in map.heights_um().chunks_exact(columns).zip(heights[stride..].chunks_exact_mut(stride)) {
            for (target, height) in framed[1..].iter_mut().zip(row) {
                *target = if height.is_finite() { sign * height } else { f64::INFINITY };
            }
            if map.closed() {
                (framed[0], framed[columns + 1]) = (framed[columns], framed[1]);
            }
        }
        Self { map, heights, stride }
    }

    /// Steps to the eight neighbours.
    fn neighbours(&self) -> [isize; 8] {
        let stride = self.stride as isize;
        [-stride - 1, -stride, -stride + 1, -1, 1, stride - 1, stride, stride + 1]
    }

    /// Measured points, not the frame.
    fn points(&self) -> impl Iterator<Item = usize> + '_ {
        let columns = self.map.columns();
        let rows = (1..=self.map.rows()).map(move |row| row * self.stride);
        rows.flat_map(move |start| start + 1..=start + columns).filter(|point| self.heights[*point].is_finite())
    }

    /// A point of the frame is one of the other side.
    fn real(&self, point: usize) -> usize {
        match point % self.stride {
            0 => point + self.stride - 2,
            column if column == self.stride - 1 => point - (self.stride - 2),
            _ => point,
        }
    }

    /// Basins: each point runs down to its lowest neighbour until there is none. Points are labelled from 1, the frame
    /// and gaps by 0; for each label its pit.
    fn basins(&self) -> (Vec<u32>, Vec<usize>) {
        let steps = self.neighbours();
        let mut labels = vec![0_u32; self.heights.len()];
        let mut pits = vec![0];
        let mut path = Vec::new();
        for start in self.points() {
            let mut point = start;
            let label = loop {
                if labels[point] != 0 {
                    break labels[point];
                }
                path.push(point);
                let (mut lowest, mut height) = (point, self.heights[point]);
                for step in steps {
                    let neighbour = point.wrapping_add_signed(step);
                    if self.heights[neighbour] < height {
                        (lowest, height) = (neighbour, self.heights[neighbour]);
                    }
                }
                if lowest == point {
                    pits.push(point);
                    break (pits.len() - 1) as u32;
                }
                point = self.real(lowest);
            };
            path.drain(..).for_each(|point| labels[point] = label);
        }
        if self.map.closed() {
            for row in labels.chunks_exact_mut(self.stride) {
                (row[0], row[self.stride - 1]) = (row[self.stride - 2], row[1]);
            }
        }
        (labels, pits)
    }

    /// Pits of the dales that are left after pruning and complete.
    ///
    /// Wolf pruning merges the shallowest dale over its lowest saddle, again and again; its neighbour there is the deeper
    /// one, or it would be the shallower dale itself. What is left is therefore what the saddles in ascending order give:
    /// where two parts first meet, the one with the higher pit ends with its depth below the saddle.
    fn extremes(&self, pruning: f64) -> Vec<Extreme> {
        let (labels, pits) = self.basins();
        let steps = self.neighbours();
        let mut edge = vec![false; pits.len()];
        let mut saddles: Vec<(f64, usize)> = Vec::new();
        for point in self.points() {
            let (label, height) = (labels[point], self.heights[point]);
            let (mut wall, mut border) = (false, false);
            for step in steps {
                let neighbour = point.wrapping_add_signed(step);
                wall |= labels[neighbour] == 0;
                border |= labels[neighbour] != label && self.heights[neighbour] <= height;
            }
            edge[label as usize] |= wall;
            if border {
                saddles.push((height, point));
            }
        }
        saddles.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let depth = |label: usize| self.heights[pits[label]];
        // Parts that are connected below the water; and what of them is one dale. A root is the label of the lowest pit.
        let (mut parts, mut dales) = (Sets::new(pits.len()), Sets::new(pits.len()));
        for (height, point) in saddles {
            for step in steps {
                let neighbour = point.wrapping_add_signed(step);
                let [a, b] = [labels[point], labels[neighbour]].map(|label| label as usize);
                if a == b || b == 0 || self.heights[neighbour] > height {
                    continue;
                }
                let [one, other] = [parts.root(a), parts.root(b)];
                if one == other {
                    continue;
                }
                let (deep, shallow) = if depth(one) <= depth(other) { (one, other) } else { (other, one) };
                parts.join(deep, shallow);
                if height - depth(shallow) < pruning {
                    let [one, other] = [dales.root(a), dales.root(b)];
                    let (deep, shallow) = if depth(one) <= depth(other) { (one, other) } else { (other, one) };
                    dales.join(deep, shallow);
                    edge[deep] |= edge[shallow];
                }
            }
        }
        (1..pits.len())
            .filter(|label| dales.root(*label) == *label && !edge[*label])
            .map(|label| Extreme { depth: depth(label), curvature: self.curvature(pits[label]) })
            .collect()
    }

    fn curvature(&self, point: usize) -> Option<f64> {
        let bend = |step: usize, distance_mm: f64| {
            // µm/mm² to 1/mm.
            let second = self.heights[point - step] - 2.0 * self.heights[point] + self.heights[point + step];
            1e-3 * second / (distance_mm * distance_mm)
        };
        let curvature = 0.5 * (bend(1, self.map.dx_mm()) + bend(self.stride, self.map.dy_mm()));
        curvature.is_finite().then_some(curvature)
    }
}

/// Disjoint sets of labels.
struct Sets(Vec<u32>);

impl Sets {
    fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn root(&mut self, mut label: usize) -> usize {
        while self.0[label] as usize != label {
            self.0[label] = self.0[self.0[label] as usize];
            label = self.0[label] as usize;
        }
        label
    }

    /// The root of the first set becomes that of both.
    fn join(&mut self, root: usize, other: usize) {
        self.0[other] = root as u32;
    }
}
