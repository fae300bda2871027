//! Feature parameters (ISO 25178-2:2021, clause 5): hills and dales by watersheds, pruned after Wolf.

use super::{HeightMap, bridge::bridged};
use runout_numerics::threads::both;

/// Peaks or pits of which the mean is S5p or S5v.
const FIVE: usize = 5;
/// Share of the map's points that may be bridged, in %: beyond it, hills and dales are those of the bridges.
const MOST_BRIDGED_PERCENT: f64 = 10.0;
/// Share of the area that hills (dales) cut by wide holes may have, in %: beyond it, the others do not stand for all.
const MOST_CUT_PERCENT: f64 = 25.0;

/// Values of the significant hills and dales. Narrow holes are bridged. Those that reach an open edge of the map are incomplete and
/// left out; so are those that a wide hole cuts, with their area.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
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
    /// Mean area of the dales, in mm²: of a dale, all that runs down to its pit.
    pub sda_mm2: f64,
    /// Mean area of the hills, in mm².
    pub sha_mm2: f64,
    /// Mean volume of the dales, in mm³: of a dale, what it holds up to the lowest saddle on its border.
    pub sdv_mm3: f64,
    /// Mean volume of the hills, in mm³: of a hill, what is above the highest saddle on its border.
    pub shv_mm3: f64,
    /// Share of the map's points that were bridged, in %.
    pub bridged_percent: f64,
    /// Share of the map's area that is wide holes, and hills or dales (what is more) that these cut, in %.
    pub cut_percent: f64,
}

impl Features {
    /// Of a map with mean 0; hills and dales lower than `pruning_um` are merged with a neighbour.
    pub(super) fn of(centred: &HeightMap, pruning_um: f64) -> Self {
        let bridged = bridged(centred);
        let bridged_percent = 100.0 * bridged.points as f64 / centred.heights_um().len() as f64;
        if bridged_percent > MOST_BRIDGED_PERCENT {
            return Self { bridged_percent, ..Self::NONE };
        }
        let map = &*bridged.map;
        let of = |sign: f64| Relief::new(map, sign).extremes(pruning_um);
        let ((dales, cut_dales), (hills, cut_hills)) = both(|| of(1.0), || of(-1.0));
        let cell_mm2 = map.dx_mm() * map.dy_mm();
        let cut_mm2 = |points: usize| cell_mm2 * (points + map.missing()) as f64;
        let cut_percent = 100.0 * cut_mm2(cut_dales.max(cut_hills)) / map.area_mm2();
        if cut_percent > MOST_CUT_PERCENT {
            return Self { bridged_percent, cut_percent, ..Self::NONE };
        }
        let per_mm2 = |count: usize, cut: usize| count as f64 / (map.area_mm2() - cut_mm2(cut));
        let [s5v, s5p] = [&dales, &hills].map(|found| {
            let mut depths: Vec<f64> = found.iter().map(|extreme| -extreme.depth).collect();
            depths.sort_unstable_by(|a, b| b.total_cmp(a));
            mean(depths.into_iter().take(FIVE))
        });
        let [sda_mm2, sha_mm2] =
            [&dales, &hills].map(|found| mean(found.iter().map(|one| one.points as f64 * cell_mm2)));
        // µm·mm² to mm³.
        let [sdv_mm3, shv_mm3] =
            [&dales, &hills].map(|found| mean(found.iter().map(|one| 1e-3 * cell_mm2 * one.below_saddle)));
        let [svc_per_mm, spc_per_mm] = [(&dales, -1.0), (&hills, 1.0)]
            .map(|(found, sign)| sign * mean(found.iter().filter_map(|one| one.curvature)));
        Self {
            hills: hills.len(),
            dales: dales.len(),
            spd_per_mm2: per_mm2(hills.len(), cut_hills),
            svd_per_mm2: per_mm2(dales.len(), cut_dales),
            spc_per_mm,
            svc_per_mm,
            s5p,
            s5v,
            s10z: s5p + s5v,
            sda_mm2,
            sha_mm2,
            sdv_mm3,
            shv_mm3,
            bridged_percent,
            cut_percent,
        }
    }

    /// Why there are none, where too much of the map is missing.
    #[must_use]
    pub fn problem(&self) -> Option<String> {
        let problem = if self.bridged_percent > MOST_BRIDGED_PERCENT {
            format!(
                "{:.1} % of the points are missing here and there; {MOST_BRIDGED_PERCENT} % are bridged",
                self.bridged_percent
            )
        } else if self.cut_percent > MOST_CUT_PERCENT {
            format!(
                "{:.0} % of the area are holes and what they cut; {MOST_CUT_PERCENT} % may be, so that the others are representative",
                self.cut_percent
            )
        } else {
            return None;
        };
        Some(format!("no values of hills and dales (Spd … Shv): {problem}"))
    }

    /// Where nothing was looked for.
    pub(super) const NONE: Self = Self {
        hills: 0,
        dales: 0,
        spd_per_mm2: f64::NAN,
        svd_per_mm2: f64::NAN,
        spc_per_mm: f64::NAN,
        svc_per_mm: f64::NAN,
        s5p: f64::NAN,
        s5v: f64::NAN,
        s10z: f64::NAN,
        sda_mm2: f64::NAN,
        sha_mm2: f64::NAN,
        sdv_mm3: f64::NAN,
        shv_mm3: f64::NAN,
        bridged_percent: 0.0,
        cut_percent: 0.0,
    };
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
    /// Points of the dale.
    points: usize,
    /// Sum of the depths of its points below the lowest saddle on its border.
    below_saddle: f64,
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
        let stride = self.stride.cast_signed();
        [-stride - 1, -stride, -stride + 1, -1, 1, stride - 1, stride, stride + 1]
    }

    /// Points of each row of the map, as indices into the frame.
    fn rows(&self) -> impl Iterator<Item = std::ops::Range<usize>> + use<> {
        let (stride, columns) = (self.stride, self.map.columns());
        (1..=self.map.rows()).map(move |row| row * stride + 1..row * stride + 1 + columns)
    }

    /// Where each point runs down to: its lowest neighbour, or itself in a pit.
    fn descent(&self) -> Vec<u32> {
        let steps = self.neighbours();
        let mut down: Vec<u32> = (0..self.heights.len() as u32).collect();
        let (mut lowest, mut way) = (vec![0.0; self.map.columns()], vec![0.0; self.map.columns()]);
        for row in self.rows() {
            lowest.copy_from_slice(&self.heights[row.clone()]);
            way.fill(0.0);
            // One direction after the other along the row, without branches, so that vector registers serve.
            for step in steps {
                let beside = &self.heights[row.start.wrapping_add_signed(step)..][..lowest.len()];
                for ((lowest, way), height) in lowest.iter_mut().zip(&mut way).zip(beside) {
                    let lower = height < lowest;
                    *lowest = if lower { *height } else { *lowest };
                    *way = if lower { step as f64 } else { *way };
                }
            }
            for (point, way) in row.clone().zip(&way) {
                down[point] = point.wrapping_add_signed(*way as isize) as u32;
            }
            // What lies in the frame is the point on the other side.
            let turn = (self.stride - 2) as u32;
            let [first, last] = [row.start, row.end - 1];
            if (down[first] as usize).is_multiple_of(self.stride) {
                down[first] += turn;
            }
            if down[last] as usize % self.stride == self.stride - 1 {
                down[last] -= turn;
            }
        }
        down
    }

    /// Basins: points that run down to the same pit. Points are labelled from 1, walls by 0; for each label its pit.
    fn basins(&self) -> (Vec<u32>, Vec<usize>) {
        let down = self.descent();
        let mut labels = vec![0_u32; self.heights.len()];
        let mut pits = vec![0];
        let mut path = Vec::new();
        for start in self.rows().flatten() {
            if labels[start] != 0 || self.heights[start] == f64::INFINITY {
                continue;
            }
            let mut point = start;
            while labels[point] == 0 && down[point] as usize != point {
                path.push(point);
                point = down[point] as usize;
            }
            if labels[point] == 0 {
                labels[point] = pits.len() as u32;
                pits.push(point);
            }
            let label = labels[point];
            path.drain(..).for_each(|point| labels[point] = label);
        }
        if self.map.closed() {
            for row in labels.chunks_exact_mut(self.stride) {
                (row[0], row[self.stride - 1]) = (row[self.stride - 2], row[1]);
            }
        }
        (labels, pits)
    }

    /// Whether a point of the frame stands for what is beyond the map.
    fn is_beyond(&self, point: usize) -> bool {
        let (row, column) = (point / self.stride, point % self.stride);
        let beside = column == 0 || column == self.stride - 1;
        row == 0 || row == self.map.rows() + 1 || (beside && !self.map.closed())
    }

    /// Pits of the dales that are left after pruning and complete, and the points of those that are cut by holes alone.
    ///
    /// Wolf pruning merges the shallowest dale over its lowest saddle, again and again; its neighbour there is the deeper
    /// one, or it would be the shallower dale itself. What is left is therefore what the saddles in ascending order give:
    /// where two parts first meet, the one with the higher pit ends with its depth below the saddle.
    fn extremes(&self, pruning: f64) -> (Vec<Extreme>, usize) {
        let (labels, pits) = self.basins();
        let steps = self.neighbours();
        let [mut edge, mut cut] = [(); 2].map(|()| vec![false; pits.len()]);
        let mut saddles: Vec<(f64, u32, u32)> = Vec::new();
        for point in self.rows().flatten() {
            let (label, height) = (labels[point], self.heights[point]);
            if label == 0 {
                continue;
            }
            // A point is the saddle to the lower neighbours that run elsewhere.
            let mut last = label;
            for step in steps {
                let neighbour = point.wrapping_add_signed(step);
                let other = labels[neighbour];
                if other == last || other == label {
                    continue;
                }
                if other == 0 {
                    let which = if self.is_beyond(neighbour) { &mut edge } else { &mut cut };
                    which[label as usize] = true;
                } else if self.heights[neighbour] <= height {
                    saddles.push((height, label, other));
                    last = other;
                }
            }
        }
        saddles.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let depths: Vec<f64> = pits.iter().map(|pit| self.heights[*pit]).collect();
        // Parts that are connected below the water; and what of them is one dale. A root is the label of the lowest pit.
        let (mut parts, mut dales) = (Sets::new(pits.len()), Sets::new(pits.len()));
        for (height, a, b) in &saddles {
            let (a, b) = (*a as usize, *b as usize);
            let Some((_, shallow)) = parts.join(a, b, &depths) else { continue };
            if *height - depths[shallow] < pruning
                && let Some((deep, shallow)) = dales.join(a, b, &depths)
            {
                edge[deep] |= edge[shallow];
                cut[deep] |= cut[shallow];
            }
        }
        let roots: Vec<usize> = (0..pits.len()).map(|label| dales.root(label)).collect();
        let mut lowest = vec![f64::INFINITY; pits.len()];
        for (height, a, b) in saddles {
            let [a, b] = [a, b].map(|label| roots[label as usize]);
            if a != b {
                (lowest[a], lowest[b]) = (lowest[a].min(height), lowest[b].min(height));
            }
        }
        let mut held = vec![(0_usize, 0.0); pits.len()];
        for point in self.rows().flatten().filter(|point| labels[*point] != 0) {
            let root = roots[labels[point] as usize];
            let depth = lowest[root] - self.heights[point];
            held[root].0 += 1;
            held[root].1 += depth.max(0.0);
        }
        let whole = |label: &usize| roots[*label] == *label && !edge[*label];
        let cut_points = (1..pits.len()).filter(whole).filter(|label| cut[*label]).map(|label| held[label].0).sum();
        let significant = (1..pits.len()).filter(whole).filter(|label| !cut[*label]);
        let extreme = |label: usize| {
            let (points, below_saddle) = held[label];
            Extreme { depth: depths[label], curvature: self.curvature(pits[label]), points, below_saddle }
        };
        (significant.map(extreme).collect(), cut_points)
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

    /// Joins the sets of two labels; the root of the deeper one becomes that of both. Deep and shallow root, where they
    /// were two.
    fn join(&mut self, a: usize, b: usize, depths: &[f64]) -> Option<(usize, usize)> {
        let [a, b] = [self.root(a), self.root(b)];
        let (deep, shallow) = if depths[a] <= depths[b] { (a, b) } else { (b, a) };
        self.0[shallow] = deep as u32;
        (a != b).then_some((deep, shallow))
    }
}
