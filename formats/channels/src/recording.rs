//! The recording that the channels make: stations, setups, and their samples block after block.

use std::path::{Path, PathBuf};

use runout_core::{
    Error, ErrorKind, Result,
    input_file::InputFile,
    measurement::{Capture, Recording, SampleStream, StationKey},
    rig::Rig,
};

use crate::{
    capture::{Place, Signals},
    config::ChannelsConfig,
    files::Files,
    resample::{self, ResampledStream},
    signal::{Conversion, Signal},
    stream::{AngleSource, ChannelStream, limits},
    turns::Turns,
};

/// What marks of two values leave open between setups.
const MARKS_AT_WHOLE_SAMPLES: &str = "marks of a channel of two values are at whole samples: half a sample is not known of the angle between \
    two setups. The stated uncertainties include it; an encoder's angle or a trace of the mark make them smaller";

/// The captures of a measurement.
pub(crate) struct ChannelRecording {
    rig: Rig,
    config: ChannelsConfig,
    stations: Vec<StationKey>,
    files: Files,
    remarks: Vec<String>,
}

impl ChannelRecording {
    /// Looks for the channels of every station and setup.
    pub(crate) fn open(rig: &Rig, config: ChannelsConfig, folder: &Path, stations: Vec<StationKey>) -> Result<Self> {
        let mut recording = Self { rig: rig.clone(), config, stations, files: Files::new(folder), remarks: Vec::new() };
        let mut remarks: Vec<String> = Vec::new();
        for station in 0..recording.stations.len() {
            for setup in 0..rig.setups.len() {
                let place = recording.place(station, setup)?;
                let Signals { sensors, clocks, common, remarks: found } = place.signals()?;
                let resampled = common.is_resampled.then(|| resample::remark(&sensors, &clocks, &common));
                for remark in found.into_iter().chain(resampled) {
                    if !remarks.contains(&remark) {
                        remarks.push(remark);
                    }
                }
            }
        }
        let place = recording.place(0, 0)?;
        let is_digital = |place: &Place| Ok::<bool, Error>(Turns::of(place, &place.signals()?)?.within_samples > 0.0);
        if rig.setups.len() > 1 && is_digital(&place)? {
            remarks.push(MARKS_AT_WHOLE_SAMPLES.into());
        }
        recording.remarks = remarks;
        Ok(recording)
    }

    fn place(&self, station: usize, setup: usize) -> Result<Place<'_>> {
        match (self.stations.get(station), self.rig.setups.get(setup)) {
            (Some(key), Some(_)) => {
                Ok(Place { config: &self.config, files: &self.files, rig: &self.rig, setup, station: key })
            }
            _ => Err(Error::new("open", format!("station {station} in setup {setup}"), "there is no such capture")
                .of(ErrorKind::MissingFile)),
        }
    }
}

impl Recording for ChannelRecording {
    fn stations(&self) -> &[StationKey] {
        &self.stations
    }

    fn open(&self, station: usize, setup: usize) -> Result<Box<dyn SampleStream + '_>> {
        let place = self.place(station, setup)?;
        let signals = place.signals()?;
        let turns = Turns::of(&place, &signals)?;
        let signs: Vec<f64> = self.rig.sensors.iter().map(|sensor| sensor.sign).collect();
        let Signals { sensors, clocks, common, .. } = signals;
        // Both factors take the sign, so that turning a sensor round changes no rounding.
        let sensors: Vec<(Signal, Conversion)> = sensors
            .into_iter()
            .zip(&signs)
            .map(|((signal, Conversion { gain, offset }), sign)| {
                (signal, Conversion { gain: gain * sign, offset: offset * sign })
            })
            .collect();
        let capture = Capture {
            object: sensors.first().map_or_else(String::new, |(signal, _)| signal.shown.clone()),
            setup,
            station: place.station.name.clone(),
            z_mm: place.station.z_mm,
            stated_speed_rpm: self.config.speed_rpm,
            sample_rate_hz: common.clock.rate_hz,
            samples: common.clock.samples,
            sensors: (0..self.rig.sensors.len()).collect(),
            sensor_ids: self.rig.sensors.iter().map(|sensor| sensor.id.clone()).collect(),
            converter_limits_um: limits(&sensors),
            marks: turns.marks,
            marks_within_samples: turns.within_samples,
            encoder: turns.angles.is_some(),
            trimmed: Vec::new(),
            responses: Vec::new(),
        };
        let angles = turns.angles.map(AngleSource::open).transpose()?;
        if common.is_resampled {
            return Ok(Box::new(ResampledStream::open(capture, &sensors, &clocks, &common, angles)?));
        }
        Ok(Box::new(ChannelStream::open(capture, &sensors, angles)?))
    }

    fn inputs(&self) -> Vec<PathBuf> {
        self.files.inputs().iter().map(|input| input.path().to_owned()).collect()
    }

    fn opened(&self) -> Result<Vec<InputFile>> {
        Ok(self.files.inputs())
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }
}
