//! Traces along an axis as a probe takes them: part and slide are functions of z, sampled where the probe truly is.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use runout_core::{
    points::{Column, Points, Trace},
    standards::straightness::about_lsli_um,
};

/// Waves: amplitude in µm, length in mm, phase in rad.
pub(crate) type Waves = Vec<[f64; 3]>;

/// A campaign.
#[derive(Clone)]
pub(crate) struct Campaign {
    pub part: Waves,
    pub slide: Waves,
    pub noise_um: f64,
    /// Step of a random walk along each trace.
    pub walk_um: f64,
    pub length_mm: f64,
    pub step_mm: f64,
    pub traces: Vec<Shot>,
    pub seed: u64,
}

/// How one trace is taken.
#[derive(Clone, Default)]
pub(crate) struct Shot {
    pub reversed: bool,
    /// The probe is at z + shift where the file says z.
    pub shift_mm: f64,
    pub gain: f64,
    /// Tilt of the part across the trace: the sagitta at the ends, in µm.
    pub bow_um: f64,
    /// Settling: amplitude in µm, time constant in lengths of a trace.
    pub drift: [f64; 2],
    pub backwards: bool,
    /// A flagged stretch with a chip under the probe.
    pub chip: bool,
    /// Waves that no other trace has, as of a drive whose phase is another one each time.
    pub own: Waves,
}

pub(crate) fn value(waves: &Waves, z: f64) -> f64 {
    waves.iter().map(|[amplitude, length, phase]| amplitude * (TAU * z / length + phase).sin()).sum()
}

/// A ground part with lay, on a smooth slide.
pub(crate) fn ground(seed: u64, repeats: [usize; 2]) -> Campaign {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut wave = |amplitude: f64, length: f64| [amplitude, length, random.random_range(0.0..TAU)];
    let mut part = vec![wave(0.8, 170.0), wave(0.3, 41.0)];
    for order in 0..14 {
        part.push(wave(0.3, 2.0 + 0.45 * f64::from(order)));
    }
    let slide = vec![wave(0.15, 190.0), wave(0.06, 63.0)];
    let of = |reversed| Shot { reversed, ..Shot::default() };
    let traces = [vec![of(false); repeats[0]], vec![of(true); repeats[1]]].concat();
    Campaign { part, slide, noise_um: 0.02, walk_um: 0.0, length_mm: 100.0, step_mm: 0.2, traces, seed }
}

impl Campaign {
    pub(crate) fn id(&self, trace: usize) -> String {
        let reversed = self.traces[trace].reversed;
        let number = self.traces[..=trace].iter().filter(|shot| shot.reversed == reversed).count();
        format!("{}-{number}", if reversed { "reversed" } else { "initial" })
    }

    pub(crate) fn points(&self) -> Points {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed + 1_000_000);
        let noise = Normal::new(0.0, self.noise_um).unwrap();
        let (mut z_mm, mut reading_um, mut flag) = (Vec::new(), Vec::new(), Vec::new());
        let mut traces = Vec::new();
        for (index, shot) in self.traces.iter().enumerate() {
            let start = z_mm.len();
            let (offset, slope) = (random.random_range(-20.0..20.0), random.random_range(-0.05..0.05));
            let first = random.random_range(0.0..self.step_mm);
            let count = (self.length_mm / self.step_mm) as usize;
            let mut walked = 0.0;
            let rows = (0..count).map(|row| if shot.backwards { count - 1 - row } else { row });
            for (row, at) in rows.enumerate() {
                let z = first + self.step_mm * at as f64;
                let truly = z + shot.shift_mm;
                let sign = if shot.reversed { -1.0 } else { 1.0 };
                let time = row as f64 / (count - 1) as f64;
                let [drift, constant] = shot.drift;
                let settling = if drift == 0.0 { 0.0 } else { drift * (-time / constant).exp() };
                let arm = (z - 0.5 * self.length_mm) / (0.5 * self.length_mm);
                let content =
                    value(&self.part, truly) + sign * value(&self.slide, truly) - shot.bow_um * arm * arm + settling;
                let chip = shot.chip && (60.0..64.0).contains(&z);
                let lifted = if chip { 3.0 } else { 0.0 };
                let error = noise.sample(&mut random);
                walked +=
                    if self.walk_um > 0.0 { self.walk_um / self.noise_um * noise.sample(&mut random) } else { 0.0 };
                z_mm.push(z);
                reading_um.push(
                    (1.0 + shot.gain) * content + lifted + offset + slope * z + error + walked + value(&shot.own, z),
                );
                flag.push(f64::from(u8::from(chip)));
            }
            let kind = if shot.reversed { "reversed" } else { "initial" };
            traces.push(Trace { id: self.id(index), kind: kind.into(), points: start..z_mm.len() });
        }
        let mut columns = vec![
            Column { name: "z_mm".into(), values: z_mm },
            Column { name: "reading_um".into(), values: reading_um },
        ];
        if flag.iter().any(|flag| *flag > 0.0) {
            columns.push(Column { name: "flag".into(), values: flag });
        }
        Points { input: "simulated.csv".into(), columns, traces, ..Points::default() }
    }

    /// Root mean square errors of part and slide on these positions.
    pub(crate) fn errors(&self, z_mm: &[f64], found: [&[f64]; 2]) -> [f64; 2] {
        let of = |found: &[f64], waves: &Waves| {
            let truth: Vec<f64> = z_mm.iter().map(|z| value(waves, *z)).collect();
            let truth = about_lsli_um(z_mm, &truth);
            rms(&found.iter().zip(truth).map(|(found, truth)| found - truth).collect::<Vec<f64>>())
        };
        [of(found[0], &self.part), of(found[1], &self.slide)]
    }
}

pub(crate) fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}
