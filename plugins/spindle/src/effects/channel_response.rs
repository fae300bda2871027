//! Effects that multiply each order of a channel by a response H(n): u becomes Re Σ H c e^{−inΦ}, and ∂/∂v = (H′/H) u for a value v.
//!
//! | effect | H(n) |
//! | --- | --- |
//! | `filter-attenuation`, `-2`, `-4` | low-pass 1/B(s), s = −i n p, B Butterworth's polynomial of order 1, 2, 4; −3 dB at order 1/p |
//! | `filter-attenuation-bessel-2`, `-4` | the same with Bessel's polynomial |
//! | `channel-delay` | e^{inδ}: the channel is late by the angle δ |
//! | `channel-skew` | e^{inkδ} of channel k: a multiplexed converter reads one channel after the other |
//! | `index-offset` | e^{−inδ} of all channels in a setup: its mark stands at another angle, for the part and for the motion |
//! | `sensor-gain` of a sensor in a setup, `setup-gain` | 1 + g |
//!
//! Time runs with e^{−inΦ}. Polynomials: A. Williams, F. Taylor, *Electronic Filter Design Handbook*, chapter 11.

use std::f64::consts::SQRT_2;

use runout_core::{
    Complex64,
    closed_loop::{diagnosis::Estimated, in_tolerances},
};

use crate::alterations::GAINS;

use super::{
    About, ActsOn, Alterations, GAIN_TOLERANCE, Predicted, RAD_PER_DEG, SpindleEffect, Transfer, parameter,
    size_of_gain,
};

/// An effect of one value that is a response of channels.
pub(crate) struct ChannelResponse {
    id: &'static str,
    does: &'static str,
    acts_on: ActsOn,
    response: Response,
}

/// What a channel does to an order.
#[derive(Debug, Clone, Copy)]
enum Response {
    /// 1/B(−i n p), by the coefficients of B from that of s⁰.
    LowPass(&'static [f64]),
    /// e^{inδ} of a delay (1), or of a mark that comes later (−1); δ in degrees.
    Delay(f64),
    /// 1 + g.
    Gain,
}

const FIRST_ORDER: &str = "filter-attenuation";
const FIRST: &[f64] = &[1.0, 1.0];
const BUTTERWORTH_2: &[f64] = &[1.0, SQRT_2, 1.0];
const BUTTERWORTH_4: &[f64] = &[1.0, 2.613_125_929_753, 3.414_213_562_373, 2.613_125_929_753, 1.0];
const BESSEL_2: &[f64] = &[1.0, 1.361_654_128_716, 0.618_033_988_750];
const BESSEL_4: &[f64] = &[1.0, 2.113_917_674_904, 1.915_134_829_831, 0.899_652_748_134, 0.190_179_184_556];

impl Response {
    /// H and ∂ln H/∂v at an order.
    fn at(self, order: f64, value: f64) -> [Complex64; 2] {
        match self {
            Self::LowPass(polynomial) => {
                let s = Complex64::new(0.0, -order * value);
                let (mut below, mut slope) = (Complex64::ZERO, Complex64::ZERO);
                for coefficient in polynomial.iter().rev() {
                    slope = slope * s + below;
                    below = below * s + coefficient;
                }
                [below.inv(), Complex64::I * order * slope / below]
            }
            Self::Delay(direction) => {
                let by_rad = direction * order * RAD_PER_DEG;
                [Complex64::cis(by_rad * value), Complex64::I * by_rad]
            }
            Self::Gain => [Complex64::from(1.0 + value), Complex64::from((1.0 + value).recip())],
        }
    }
}

impl ChannelResponse {
    /// All of them.
    pub(super) fn all() -> impl Iterator<Item = Self> {
        let of = |id, does, acts_on, response| Self { id, does, acts_on, response };
        let low_pass = move |id, does, polynomial| of(id, does, ActsOn::Sensor, Response::LowPass(polynomial));
        [
            low_pass(FIRST_ORDER, "a first-order low-pass in one channel", FIRST),
            low_pass("filter-attenuation-2", "a Butterworth low-pass of second order in one channel", BUTTERWORTH_2),
            low_pass("filter-attenuation-4", "a Butterworth low-pass of fourth order in one channel", BUTTERWORTH_4),
            low_pass("filter-attenuation-bessel-2", "a Bessel low-pass of second order in one channel", BESSEL_2),
            low_pass("filter-attenuation-bessel-4", "a Bessel low-pass of fourth order in one channel", BESSEL_4),
            of("channel-delay", "a channel is later than the others", ActsOn::Sensor, Response::Delay(1.0)),
            of("channel-skew", "each channel is later than the one before it", ActsOn::Rig, Response::Delay(1.0)),
            of("index-offset", "the mark of a setup is at another angle", ActsOn::OddSetup, Response::Delay(-1.0)),
            of("sensor-gain", "a sensor's gain differs in one setup", ActsOn::SensorInSetup, Response::Gain),
            of("setup-gain", "all readings of a setup are too large by a factor", ActsOn::Setup, Response::Gain),
        ]
        .into_iter()
    }

    /// The only sensor and the only setup in which it acts.
    fn only(&self, target: usize, setups: usize) -> [Option<usize>; 2] {
        match self.acts_on {
            ActsOn::Sensor => [Some(target), None],
            ActsOn::Setup | ActsOn::OddSetup => [None, Some(target)],
            ActsOn::SensorInSetup => [Some(target / setups), Some(target % setups)],
            _ => [None, None],
        }
    }

    /// What an order counts for in a channel: of a skew, the first channel is the reference.
    fn order_in(&self, order: usize, sensor: usize) -> f64 {
        let times = if self.acts_on == ActsOn::Rig { sensor } else { 1 };
        (order * times) as f64
    }
}

impl SpindleEffect for ChannelResponse {
    fn about(&self) -> About {
        let parameters = match self.response {
            // −3 dB at order 1000.
            Response::LowPass(_) => parameter("inverse-cut-off", "rev", 1e-3),
            Response::Delay(direction) if direction < 0.0 => parameter("angle", "deg", 0.3),
            // Half a sample of 512 a turn.
            Response::Delay(_) => parameter("delay", "deg", 0.3),
            Response::Gain => parameter("gain", "1", GAIN_TOLERANCE),
        };
        About { id: self.id, does: self.does, acts_on: self.acts_on, parameters: vec![parameters] }
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        let [only, setup] = self.only(target, alterations.setups.len());
        let (response, value) = (self.response, values[0]);
        for (sensor, altered) in alterations.sensors.iter_mut().enumerate() {
            if only.is_none_or(|only| only == sensor) {
                let times = self.order_in(1, sensor);
                let transfer = Transfer::new(move |order| response.at(order as f64 * times, value)[0]);
                altered.transfers.push(transfer.of(self.id, values).in_setup(setup));
            }
        }
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let [sensor, setup] = self.only(target, predicted.alterations.setups.len());
        let readings = &predicted.layout.readings;
        let applied = predicted.alterations.sensors[sensor.unwrap_or(0)].applied_in(self.id, setup);
        let value = applied.map_or(0.0, |values| values[0]);
        let on = |reading: &crate::layout::Reading| {
            sensor.is_none_or(|only| only == reading.sensor) && setup.is_none_or(|only| only == reading.setup)
        };
        let change = |order: usize, at: usize| {
            let order = self.order_in(order, readings[at % readings.len()].sensor);
            self.response.at(order, value)[1] * predicted.readings[at]
        };
        vec![predicted.each(on, change)]
    }

    fn size(&self, values: &[f64]) -> f64 {
        match self.response {
            Response::Gain => size_of_gain(values),
            _ => in_tolerances(&self.about().parameters, values),
        }
    }

    fn first_order_like(&self) -> Option<&'static str> {
        // ∂H/∂p at 0 is that of the first order, to a factor.
        matches!(self.response, Response::LowPass(polynomial) if polynomial.len() > FIRST.len()).then_some(FIRST_ORDER)
    }

    fn is_possible(&self, values: &[f64]) -> bool {
        match self.response {
            // A negative one amplifies.
            Response::LowPass(_) => values.first().is_some_and(|inverse_cutoff| *inverse_cutoff > 0.0),
            Response::Gain => values.iter().all(|gain| GAINS.contains(&(1.0 + gain))),
            Response::Delay(_) => true,
        }
    }

    fn present(&self, estimated: Vec<Estimated>) -> Vec<Estimated> {
        let Response::LowPass(_) = self.response else { return estimated };
        let cut_off = |inverse: Estimated| Estimated {
            name: "cut-off".into(),
            value: inverse.value.recip(),
            std: inverse.std.map(|std| std / (inverse.value * inverse.value)),
            unit: "1/rev".into(),
        };
        estimated.into_iter().map(cut_off).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn low_passes_are_3_db_down_at_their_cut_off_and_fall_as_their_order_does() {
        for (polynomial, order) in [(FIRST, 1), (BUTTERWORTH_2, 2), (BUTTERWORTH_4, 4), (BESSEL_2, 2), (BESSEL_4, 4)] {
            let gain = |times: f64| Response::LowPass(polynomial).at(times, 1.0)[0].norm();
            // Coefficients have twelve decimals.
            assert!((gain(1.0) - SQRT_2.recip()).abs() < 1e-11, "{polynomial:?}: {}", gain(1.0));
            let falls = (gain(1e3) / gain(1e4)).log10();
            assert!((falls - f64::from(order)).abs() < 1e-3, "{polynomial:?}: {falls}");
        }
    }

    #[test]
    fn a_bessel_filter_delays_all_low_orders_alike() {
        let delay = |order: f64| Response::LowPass(BESSEL_4).at(order, 0.01)[0].arg() / order;
        // The group delay of one of fourth order is flat to 1 % up to its cut-off.
        assert!((delay(50.0) / delay(1.0) - 1.0).abs() < 0.01, "{} {}", delay(50.0), delay(1.0));
    }
}
