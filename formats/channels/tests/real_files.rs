//! Files of other programs (`formats` in the folder that `RUNOUT_DATA` names, with their sources and licences).

#[path = "../../../tests/support/measured_data.rs"]
mod measured_data;

use crate::support::{opened, samples};

/// What is asked of a channel: its path, unit, rate in Hz, number of samples, the first and the last.
type Expected = (&'static str, Option<&'static str>, Option<f64>, usize, f64, f64);

const TIME: f64 = 1e-6;

/// Read from the files by a text editor, or by lvmio, SciPy and pyuff.
const FILES: [(&str, &[Expected]); 17] = [
    ("lvm/labview2026-delta_x_2048hz.lvm", &[("Untitled", None, Some(2048.0), 3000, 0.0, 3.0)]),
    (
        "lvm/labview2026-express_default.lvm",
        &[("Untitled", None, Some(1.0), 3, 1.0, -3.25), ("Untitled 1", None, Some(1.0), 3, 4.0, 6.0)],
    ),
    (
        "lvm/labview2026-appended_runs.lvm",
        &[("Run 0/Untitled", None, Some(1.0), 3, 1.0, -3.25), ("Run 1/Untitled", None, Some(1.0), 2, 7.0, 8.0)],
    ),
    ("lvm/labview2026-negative_dx.lvm", &[("Untitled", None, None, 3, 1.0, 3.0)]),
    ("lvm/labview2026-period_decimal.lvm", &[("Untitled", None, Some(1.0), 3, 1.0, -3.25)]),
    ("lvm/labview2026-specials.lvm", &[("Untitled 1", None, Some(1.0), 3, f64::INFINITY, 0.0)]),
    ("lvm/short_new_line_end.lvm", &[("Response (Trigger)", Some("m/s^2"), Some(25_600.0), 10, 1.204_792, 1.212_775)]),
    ("lvm/with_empty_fields.lvm", &[("Dev0/Ai2", None, Some(1000.0), 7, 7.254_639, 7.254_639)]),
    (
        "scopes/DS1054Z-A.csv",
        &[("CH1", Some("Volt"), Some(2e9), 1200, 3.28, 4.08), ("CH4", Some("Volt"), Some(2e9), 1200, 0.0, -0.2)],
    ),
    ("scopes/DS2072A-7.csv", &[("CH2", Some("Volt"), Some(2e5), 1400, 0.016, 0.296)]),
    (
        "uff/Sample_UFF58b_bin.uff",
        &[(
            "Mic 01.0Scalar/Mic 01",
            Some("Pa"),
            Some(65_535.95),
            79_292,
            -0.014_755_260_199_308_395,
            -0.004_314_688_965_678_215,
        )],
    ),
    (
        "uff/sample_dataset58_psd.uff",
        &[("Power Spectral Density (PSD)/Pilot 1", Some("g²/Hz"), None, 3201, 0.0, 2.634_827e-10)],
    ),
    (
        "mat/scipy-big_endian.mat",
        &[("floats[:, 0]", None, None, 2, 2.0, 3.0), ("floats[:, 1]", None, None, 2, 3.0, 4.0)],
    ),
    ("mat/scipy-testmatrix_4.2c_SOL2.mat", &[("testmatrix[0, :]", None, None, 5, 1.0, 5.0)]),
    ("mat/scipy-testcell_7.4_GLNX86.mat", &[("testcell/[3]", None, None, 3, 1.0, 3.0)]),
    ("wav/test-44100Hz-2ch-32bit-float-le.wav", &[("ch1", None, Some(44_100.0), 441, 0.0, 0.509_851_396_083_831_8)]),
    // −2²³ and 2²³ − 1 of 2²³.
    ("wav/test-8000Hz-le-3ch-5S-24bit-rf64.wav", &[("ch1", None, Some(8000.0), 5, -1.0, 8_388_607.0 / 8_388_608.0)]),
];

#[test]
#[allow(clippy::float_cmp, reason = "numbers as they are written")]
fn files_of_other_programs_are_read() {
    for (place, expected) in FILES {
        let Some(path) = measured_data::optional_file(&format!("formats/{place}")) else { continue };
        let file = opened(&path).unwrap();
        for (name, unit, rate_hz, count, first, last) in expected {
            let index = file.channels().iter().position(|channel| channel.path() == *name);
            let index = index.unwrap_or_else(|| panic!("{place}: no channel {name}"));
            let (channel, values) = (&file.channels()[index], samples(&*file, index, 1000).unwrap());
            assert_eq!(channel.unit.as_deref(), *unit, "{place}: {name}");
            let same = |(found, expected): (f64, &f64)| (found / expected - 1.0).abs() < TIME;
            assert_eq!(channel.rate_hz.is_some(), rate_hz.is_some(), "{place}: {name}: {:?}", channel.rate_hz);
            assert!(channel.rate_hz.zip(rate_hz.as_ref()).is_none_or(same), "{place}: {name}: {:?}", channel.rate_hz);
            assert_eq!((values.len(), values[0], values[values.len() - 1]), (*count, *first, *last), "{place}: {name}");
        }
    }
}

/// WAV files whose numbers have no form that is read are refused with words.
#[test]
fn odd_files_of_other_programs_are_refused() {
    for (place, words) in [
        ("wav/test-8000Hz-le-3ch-5S-53bit.wav", "expected whole numbers of 8 to 64 bits"),
        ("wav/test-44100Hz-le-1ch-4bytes-incomplete-chunk.wav", "expected 4 more bytes"),
    ] {
        let Some(path) = measured_data::optional_file(&format!("formats/{place}")) else { continue };
        let error = opened(&path).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}
