//! A separator of turns that is a program: profiles and their covariance out, harmonics of form and motion in.

use runout_core::{
    Complex64, Error, Result,
    fault::Fault,
    profile::Profile,
    rig::Rig,
    separation::{Assessment, Quantity, Residual, SectionAt, Sensitivity, Separation},
    stage::{Station, StationSeparator},
    table::{ColumnSpec, TableSpec, counts, numbers, stretches},
};
use serde_json::{Value, json};

use crate::{
    answer::Answer,
    frame::Frame,
    session::Session,
    tables::{Table, encode},
};

/// Two sections nearer than this are at the same z.
const SAME_Z_MM: f64 = 1e-6;
const HARMONICS: [&str; 7] = ["station", "quantity", "section", "order", "re", "im", "std"];

/// What is not known before the program is asked.
const NOTES: [&str; 2] = [
    "an external separator: which orders it loses, and ±, are known after the run",
    "E_n against an external separator is not known: nothing says how its estimates follow from the readings",
];

/// A separator for one rig.
pub(crate) struct TurnSeparator {
    session: Session,
    config: Value,
    rig: Rig,
    unknowns: Vec<Quantity>,
}

impl TurnSeparator {
    /// For a rig.
    ///
    /// # Errors
    /// When the protocol has no tables for it.
    pub(crate) fn new(session: Session, config: Value, rig: &Rig) -> std::result::Result<Self, Fault> {
        let help = "plugin = \"harmonic-least-squares\" takes any rig";
        if let Some(axial) = rig.sensors.iter().find(|sensor| sensor.axial_radius_mm.is_some()) {
            let message = format!("external has no tables for the axial sensor `{}`", axial.id);
            return Err(Fault::unfit(message).help(help));
        }
        if let Some(section) = rig.form_bounds_um.iter().position(Option::is_some) {
            let message = format!("external cannot take `form_um` of section `{}`", rig.sections[section]);
            return Err(Fault::unfit(message).help(help));
        }
        let mut unknowns: Vec<Quantity> = (0..rig.sections.len()).map(Quantity::Form).collect();
        unknowns.extend([Quantity::X, Quantity::Y]);
        if has_tilt(rig) {
            unknowns.extend([Quantity::TiltX, Quantity::TiltY]);
        }
        Ok(Self { session, config, rig: rig.clone(), unknowns })
    }

    /// Profiles and covariance of a station, as the program gets them; for tests without one of their columns.
    ///
    /// # Errors
    /// When Arrow refuses the tables.
    pub(crate) fn request(&self, station: &Station, without: Option<&str>) -> Result<Vec<u8>> {
        let place = json!({ "station": station.name, "z_mm": station.z_mm, "turns": turns(station) });
        let about = [
            ("stage", "separate-turns".to_owned()),
            ("config", self.config.to_string()),
            ("rig", rig_of(&self.rig).to_string()),
            ("station", place.to_string()),
        ];
        let mut request = Vec::new();
        for (spec, columns) in [(profiles(), self.means(station)), (covariance(), self.covariances(station))] {
            let rows = spec.rows(columns)?;
            let kept = spec.columns.iter().enumerate().filter(|(_, column)| Some(column.name.as_str()) != without);
            let kept: Vec<usize> = kept.map(|(index, _)| index).collect();
            let frame = rows.project(&kept).and_then(|rows| encode(&spec.name, &rows, &about));
            let frame = frame.map_err(|error| Error::caused("write", format!("the table {}", spec.name), error))?;
            frame.append_to(&mut request);
        }
        Frame::end().append_to(&mut request);
        Ok(request)
    }

    fn means(&self, station: &Station) -> Vec<runout_core::table::ArrayRef> {
        let rows = || {
            station.profiles.iter().flat_map(|profile| {
                let orders = 0..=profile.max_order();
                orders.flat_map(move |order| {
                    profile
                        .order(order)
                        .iter()
                        .enumerate()
                        .map(move |(channel, mean)| (profile, order, profile.sensors[channel], *mean))
                })
            })
        };
        let setup = |profile: &Profile| (self.rig.setups[profile.setup].id.as_str(), profile.mean.len());
        vec![
            stretches([(station.name.as_str(), rows().count())]),
            stretches(station.profiles.iter().map(setup)),
            stretches(rows().map(|(_, _, sensor, _)| (self.rig.sensors[sensor].id.as_str(), 1))),
            counts(rows().map(|(_, order, _, _)| order)),
            numbers(rows().map(|(_, _, _, mean)| mean.re)),
            numbers(rows().map(|(_, _, _, mean)| mean.im)),
        ]
    }

    fn covariances(&self, station: &Station) -> Vec<runout_core::table::ArrayRef> {
        let rows = || {
            station.profiles.iter().flat_map(|profile| {
                let channels = profile.channels();
                let entries = profile.covariance.iter().flatten().enumerate();
                entries.map(move |(index, entry)| {
                    let [a, b] =
                        [index / channels % channels, index % channels].map(|channel| profile.sensors[channel]);
                    (index / (channels * channels), a, b, *entry)
                })
            })
        };
        let setup = |profile: &Profile| {
            (self.rig.setups[profile.setup].id.as_str(), profile.covariance.as_ref().map_or(0, Vec::len))
        };
        let sensor = |index: usize| (self.rig.sensors[index].id.as_str(), 1);
        vec![
            stretches([(station.name.as_str(), rows().count())]),
            stretches(station.profiles.iter().map(setup)),
            counts(rows().map(|(order, ..)| order)),
            stretches(rows().map(|(_, a, _, _)| sensor(a))),
            stretches(rows().map(|(_, _, b, _)| sensor(b))),
            numbers(rows().map(|(.., entry)| entry.re)),
            numbers(rows().map(|(.., entry)| entry.im)),
        ]
    }

    /// What an answer says of a station.
    fn separation(&self, station: &Station, answer: &[Frame]) -> std::result::Result<Separation, String> {
        let answer = Answer::of(answer, &["harmonics"])?;
        let table = Table::decode(answer.table("harmonics").ok_or("gave no table `harmonics`")?, &HARMONICS)?;
        let mut warnings = answer.warnings;
        let max_order = station.profiles.iter().map(Profile::max_order).max().unwrap_or(0);
        let width = self.unknowns.len();
        let lost = Complex64::new(f64::NAN, f64::NAN);
        // Without a row, an order is lost; that of the mean level is 0.
        let of_order = |order: usize| order == 0;
        let places = || (0..(max_order + 1) * width).map(|place| place / width);
        let mut estimate: Vec<Complex64> =
            places().map(|at| if of_order(at) { Complex64::ZERO } else { lost }).collect();
        let mut variance: Vec<f64> = places().map(|at| if of_order(at) { 0.0 } else { f64::NAN }).collect();
        let mut observable: Vec<bool> = places().map(of_order).collect();
        let mut given = vec![false; estimate.len()];
        let rows = Rows::of(&table)?;
        for row in 0..table.count() {
            let place = self.place(&rows, row, station, max_order)?;
            if std::mem::replace(&mut given[place], true) {
                return Err(format!("gave {} twice", self.named(place)));
            }
            let (re, im) = match (rows.re[row], rows.im[row]) {
                (Some(re), Some(im)) => (re, im),
                (None, None) => continue,
                _ => {
                    return Err(format!(
                        "gave {} with one of `re` and `im`: both, or null for a lost order",
                        self.named(place)
                    ));
                }
            };
            estimate[place] = Complex64::new(re, im);
            observable[place] = true;
            variance[place] = match rows.std.as_ref().and_then(|std| std[row]) {
                Some(std) if std < 0.0 => {
                    return Err(format!("gave {} with a `std` below 0: {std}", self.named(place)));
                }
                std => std.map_or(f64::NAN, |std| std * std),
            };
        }
        let unknown_noise = observable.iter().zip(&variance).filter(|(seen, variance)| **seen && variance.is_nan());
        match unknown_noise.count() {
            0 => {}
            _ if rows.std.is_none() => warnings.push("the separator gives no `std`: there is no ±".into()),
            count => {
                warnings.push(format!("the separator gives no `std` of {count} harmonics: what they enter has no ±"));
            }
        }
        let z_mm = |index: usize| self.rig.section_z_mm(index) + station.z_mm;
        let sections = self.rig.sections.iter().enumerate();
        let mean_z_mm = self.rig.sensors.iter().map(|sensor| sensor.z_mm).sum::<f64>() / self.rig.sensors.len() as f64;
        Ok(Separation {
            sections: sections.map(|(index, id)| SectionAt::whole(id.clone(), z_mm(index))).collect(),
            unknowns: self.unknowns.clone(),
            estimate,
            variance,
            observable,
            motion_z_mm: if has_tilt(&self.rig) { 0.0 } else { mean_z_mm + station.z_mm },
            residual: Residual {
                rms_um: f64::NAN,
                expected_rms_um: f64::NAN,
                chi2_per_dof: f64::NAN,
                ..Residual::default()
            },
            warnings,
            ..Separation::default()
        })
    }

    /// Where a row of `harmonics` belongs, `[order][unknown]`.
    fn place(
        &self,
        rows: &Rows,
        row: usize,
        station: &Station,
        max_order: usize,
    ) -> std::result::Result<usize, String> {
        let text = |column: &[Option<String>]| column[row].clone().unwrap_or_default();
        let named = text(&rows.station);
        if named != station.name {
            return Err(format!("gave harmonics of station `{named}`, and was asked for `{}`", station.name));
        }
        let (quantity, section) = (text(&rows.quantity), text(&rows.section));
        let of_section = |unknown: &Quantity| unknown.section().map_or("", |index| self.rig.sections[index].as_str());
        let is_meant = |unknown: &Quantity| unknown.id() == quantity && of_section(unknown) == section;
        let unknown = self.unknowns.iter().position(is_meant).ok_or_else(|| {
            let known: Vec<String> =
                self.unknowns.iter().map(|one| format!("{} {}", one.id(), of_section(one)).trim().to_owned()).collect();
            format!("gave harmonics of `{}`: expected {}", format!("{quantity} {section}").trim(), known.join(", "))
        })?;
        match rows.order[row] {
            Some(order) if order <= max_order => Ok(order * self.unknowns.len() + unknown),
            Some(order) if order < usize::MAX => {
                Err(format!("gave order {order} of {quantity}: the profiles have {max_order}"))
            }
            _ => Err(format!("gave {quantity} at an order that is null or negative")),
        }
    }

    fn named(&self, place: usize) -> String {
        let unknown = self.unknowns[place % self.unknowns.len()];
        let section = unknown.section().map(|index| format!(" {}", self.rig.sections[index])).unwrap_or_default();
        format!("{}{section} of order {}", unknown.id(), place / self.unknowns.len())
    }
}

/// Columns of `harmonics`.
struct Rows {
    station: Vec<Option<String>>,
    quantity: Vec<Option<String>>,
    section: Vec<Option<String>>,
    order: Vec<Option<usize>>,
    re: Vec<Option<f64>>,
    im: Vec<Option<f64>>,
    std: Option<Vec<Option<f64>>>,
}

impl Rows {
    fn of(table: &Table) -> std::result::Result<Self, String> {
        Ok(Self {
            station: table.needed("station", table.texts("station"))?,
            quantity: table.needed("quantity", table.texts("quantity"))?,
            section: table.needed("section", table.texts("section"))?,
            order: table.needed("order", table.counts("order"))?,
            re: table.needed("re", table.numbers("re"))?,
            im: table.needed("im", table.numbers("im"))?,
            std: table.numbers("std")?,
        })
    }
}

impl StationSeparator for TurnSeparator {
    fn assess(&self, _max_order: usize) -> std::result::Result<Assessment, Fault> {
        let notes = NOTES.map(str::to_owned).into();
        Ok(Assessment { unknowns: self.unknowns.clone(), orders: Vec::new(), unused: Vec::new(), notes })
    }

    fn separate(&self, station: &Station) -> Result<Separation> {
        let object = format!("station {}", station.name);
        let request = self.request(station, None)?;
        self.session.answer(("separate", &object), request, |answer| self.separation(station, answer))
    }

    fn sensitivity(&self, _station: &Station) -> Result<Option<Sensitivity>> {
        Ok(None)
    }

    fn messages(&self) -> Vec<String> {
        self.session.lines()
    }
}

/// Whether sensors at more than one z show tilt.
fn has_tilt(rig: &Rig) -> bool {
    let first = rig.sensors.first().map_or(0.0, |sensor| sensor.z_mm);
    rig.sensors.iter().any(|sensor| (sensor.z_mm - first).abs() > SAME_Z_MM)
}

/// Turns behind the averages, by setup.
fn turns(station: &Station) -> Vec<usize> {
    station.profiles.iter().map(|profile| profile.turns.used).collect()
}

fn profiles() -> TableSpec {
    TableSpec::new(
        "profiles",
        "averages over the turns, Re sum c exp(-i n Phi)",
        vec![
            ColumnSpec::name("station", "name of the station"),
            ColumnSpec::name("setup", "id of the setup"),
            ColumnSpec::name("sensor", "id of the sensor"),
            ColumnSpec::count("order", "", "undulations per revolution"),
            ColumnSpec::number("re", "um", "real part of c"),
            ColumnSpec::number("im", "um", "imaginary part of c"),
        ],
    )
}

fn covariance() -> TableSpec {
    TableSpec::new(
        "covariance",
        "covariance of the averages of two sensors of one setup, E[d_a conj(d_b)]; no rows below two turns",
        vec![
            ColumnSpec::name("station", "name of the station"),
            ColumnSpec::name("setup", "id of the setup"),
            ColumnSpec::count("order", "", "undulations per revolution"),
            ColumnSpec::name("sensor_a", "id of one sensor"),
            ColumnSpec::name("sensor_b", "id of the other"),
            ColumnSpec::number("re", "um2", "real part"),
            ColumnSpec::number("im", "um2", "imaginary part"),
        ],
    )
}

/// The rig as programs get it: angles and places. Signs, units and gains are applied to the readings.
pub(crate) fn rig_of(rig: &Rig) -> Value {
    let sensors: Vec<Value> = rig
        .sensors
        .iter()
        .map(|sensor| {
            json!({
                "id": sensor.id,
                "angle_deg": sensor.angle_rad.to_degrees(),
                "z_mm": sensor.z_mm,
                "section": rig.sections[sensor.section],
            })
        })
        .collect();
    let setups: Vec<Value> = rig
        .setups
        .iter()
        .map(|setup| {
            json!({
                "id": setup.id,
                "part_deg": setup.part_rad.to_degrees(),
                "sensors_deg": setup.sensors_rad.to_degrees(),
            })
        })
        .collect();
    json!({ "part_radius_mm": rig.part_radius_mm, "rotation": rig.rotation, "sensors": sensors, "setups": setups })
}
