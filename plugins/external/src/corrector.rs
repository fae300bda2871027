//! A preprocessor behind the averaging: the average of one capture out, what becomes of it in.

use runout_core::{
    Complex64, Error, Result,
    profile::Profile,
    profile_change::ProfileChange,
    rig::Rig,
    stage::Corrector,
    table::{ColumnSpec, TableSpec, counts, numbers, stretches},
};
use serde_json::{Value, json};

use crate::{
    answer::Answer,
    frame::Frame,
    session::Session,
    tables::{Table, encode},
    turns::rig_of,
};

const COLUMNS: [&str; 6] = ["sensor", "order", "re", "im", "gain_re", "gain_im"];

/// What changes averages.
pub(crate) struct ExternalCorrector {
    pub session: Session,
    pub config: Value,
    pub rig: Rig,
}

impl ExternalCorrector {
    fn request(&self, profile: &Profile) -> Result<Vec<u8>> {
        let spec = TableSpec::new(
            "profile",
            "the average over the turns of one capture, Re sum c exp(-i n Phi)",
            vec![
                ColumnSpec::name("sensor", "id of the sensor"),
                ColumnSpec::count("order", "", "undulations per revolution"),
                ColumnSpec::number("re", "um", "real part of c"),
                ColumnSpec::number("im", "um", "imaginary part of c"),
            ],
        );
        let capture = json!({
            "capture": profile.object,
            "setup": self.rig.setups[profile.setup].id,
            "turns": profile.turns.used,
            "speed_rpm": profile.speed_rpm,
            "sample_rate_hz": profile.sample_rate_hz,
        });
        let about = [
            ("stage", "preprocess".to_owned()),
            ("config", self.config.to_string()),
            ("rig", rig_of(&self.rig).to_string()),
            ("capture", capture.to_string()),
        ];
        let channels = profile.channels();
        let sensors = (0..profile.mean.len()).map(|index| (self.sensor(profile, index % channels), 1));
        let rows = spec.rows(vec![
            stretches(sensors),
            counts((0..profile.mean.len()).map(|index| index / channels)),
            numbers(profile.mean.iter().map(|value| value.re)),
            numbers(profile.mean.iter().map(|value| value.im)),
        ])?;
        let frame = encode(&spec.name, &rows, &about)
            .map_err(|error| Error::caused("write", format!("the table {}", spec.name), error))?;
        let mut request = Vec::new();
        frame.append_to(&mut request);
        Frame::end().append_to(&mut request);
        Ok(request)
    }

    fn sensor(&self, profile: &Profile, channel: usize) -> &str {
        &self.rig.sensors[profile.sensors[channel]].id
    }

    /// What an answer says: a harmonic without a row stays as it is.
    fn changed(&self, profile: &Profile, answer: &[Frame]) -> std::result::Result<ProfileChange, String> {
        let answer = Answer::of(answer, &["profile"])?;
        let table = Table::decode(answer.table("profile").ok_or("gave no table `profile`")?, &COLUMNS)?;
        let sensors = table.needed("sensor", table.texts("sensor"))?;
        let orders = table.needed("order", table.counts("order"))?;
        let [re, im] = ["re", "im"].map(|name| table.needed(name, table.numbers(name)));
        let (re, im) = (re?, im?);
        let gains = match (table.numbers("gain_re")?, table.numbers("gain_im")?) {
            (Some(re), Some(im)) => Some([re, im]),
            (None, None) => None,
            _ => return Err("gave one of `gain_re` and `gain_im`: both, or none for 1".into()),
        };
        let channels = profile.channels();
        let (mut new, mut gain) = (profile.mean.clone(), vec![Complex64::ONE; profile.mean.len()]);
        let mut given = vec![false; new.len()];
        for row in 0..table.count() {
            let named = sensors[row].as_deref().unwrap_or_default();
            let channel = (0..channels).find(|channel| self.sensor(profile, *channel) == named);
            let channel =
                channel.ok_or_else(|| format!("gave a harmonic of the sensor `{named}`, which was not asked for"))?;
            let place = orders[row].map(|order| order.saturating_mul(channels).saturating_add(channel));
            let Some(place) = place.filter(|place| *place < new.len()) else {
                return Err(format!(
                    "gave a harmonic of {named} at an order that is not one of 0 to {}",
                    profile.max_order()
                ));
            };
            let what = format!("{named} at order {}", place / channels);
            if std::mem::replace(&mut given[place], true) {
                return Err(format!("gave {what} twice"));
            }
            let number = |[re, im]: [Option<f64>; 2]| {
                let both = re.zip(im).map(|(re, im)| Complex64::new(re, im));
                both.ok_or_else(|| {
                    format!("gave a null for {what}: expected a number; the separator says what is lost")
                })
            };
            new[place] = number([re[row], im[row]])?;
            if let Some([re, im]) = &gains {
                gain[place] = number([re[row], im[row]])?;
            }
            // The mean level is a real number.
            if place < channels && (new[place].im != 0.0 || gain[place].im != 0.0) {
                return Err(format!("gave {what} with an imaginary part: a mean level has none"));
            }
        }
        Ok(ProfileChange { new, gain, warnings: answer.warnings })
    }
}

impl Corrector for ExternalCorrector {
    fn change(&self, profile: &Profile) -> Result<ProfileChange> {
        let request = self.request(profile)?;
        self.session.answer(("preprocess", &profile.object), request, |answer| self.changed(profile, answer))
    }
}
