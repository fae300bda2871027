//! Figures that the READMEs print, all from simulated campaigns.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program that prints tables")]

use std::{path::Path, process::ExitCode};

use runout_core::{Error, Result, atomic_file};
use runout_studies::{
    averaging, axial,
    blind::{self, domains, draw::Layout, points::Domain},
    consistency, coverage, eccentricity, flat,
    minimum_zone_cylinder::{self, Wall},
    monte_carlo, points_pictures, results, rotor, scaling, spatial, straightness, surface as unrolled,
    values::{self, Spectrum},
    walls,
};

const USAGE: &str = "usage: runout-studies eccentricity [SEEDS]   form error against clamping eccentricity
       runout-studies averaging [PICTURE]    Ra against the turns averaged; PICTURE is a PNG file
       runout-studies axial [CAMPAIGNS [SEED]]   the same of axial error motion, from a seed on
       runout-studies consistency [CAMPAIGNS [SEED [DOMAIN]]]   what the tests of the data say of sound and of troubled campaigns
       runout-studies coverage [CAMPAIGNS]   how often the 95 % intervals hold the truth
       runout-studies value-coverage [CAMPAIGNS [SEED [LAYOUT]]]   the same of every value of the standards, two rigs and two
                                             spectra, from a seed on; LAYOUT is four or six
       runout-studies wall-coverage [WALLS [SEED]]   the same of measured walls: positions, lines, texture along the axis
       runout-studies blind [CAMPAIGNS [SEED [FILE [LAYOUT]]]]   what the closed loop says of campaigns that it knows
                                             nothing of; LAYOUT is four, six or reversed
       runout-studies blind --domain NAME [CAMPAIGNS [SEED [FILE]]]   the same of measured points: rotary-axis, touch-probe, …
       runout-studies blind-campaign INDEX [SEED [LAYOUT]]   one of them in full; of points with --domain NAME
       runout-studies monte-carlo [CAMPAIGNS]   time of many campaigns, on one thread and on all
       runout-studies diagnose-scaling       time of a diagnosis over the number of stations
       runout-studies spatial-coverage [MACHINES [SEED [PLACES]]]   predictions of the spatial error beside the truth: of 90 to
                                             160 places, or of as many as PLACES
       runout-studies spatial-placement [MACHINES [SEED]]   placement of the tracker beside the truth
       runout-studies surface PIPELINE PICTURE   the surface of a pipeline, unrolled
       runout-studies component-errors PIPELINE PICTURE   component errors of a C axis over the command
       runout-studies flat PIPELINE PICTURE      a fly-cut surface, and the same without what the closed loop found
       runout-studies pretravel PIPELINE PICTURE   pre-travel of a touch-trigger probe by direction
       runout-studies straightness-traces FILE   the simulated traces of example 4, as CSV
       runout-studies straightness FILE PICTURE  what axial-reversal makes of them, beside the truth
       runout-studies compare-results A B [RELATIVE]   numbers of two folders that differ by more
       runout-studies rotor                  frequencies of rotors beside closed forms and beside ross-rotordynamics
       runout-studies campbell ROTOR PICTURE MOST_RPM MODES   Campbell diagram of a rotor's TOML, as PNG
       runout-studies minimum-zone-cylinder [WALLS [STARTS]]   MZCY beside a global search, simulated and measured";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let domain = match domain(&mut words) {
        Ok(domain) => domain,
        Err(error) => {
            eprintln!("error: {error}");
            return ExitCode::from(2);
        }
    };
    let outcome = match words[..] {
        ["blind", ref rest @ ..] if domain.is_some() && rest.len() <= 3 && sizes(rest, [200, 1]).is_some() => {
            let sizes = sizes(rest, [200, 1]).unwrap_or_default();
            domain.map_or(Ok(()), |domain| blind_points(domain, sizes, rest.get(2).copied()))
        }
        ["blind-campaign", ref rest @ ..] if domain.is_some() && rest.len() <= 2 && sizes(rest, [0, 1]).is_some() => {
            domain.map_or(Ok(()), |domain| blind_campaign_of_points(domain, sizes(rest, [0, 1]).unwrap_or_default()))
        }
        _ if domain.is_some() => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
        ["eccentricity"] => eccentricity::rows(20).map(|rows| println!("{}", eccentricity::table(&rows))),
        ["eccentricity", seeds] if seeds.parse::<u64>().is_ok() => {
            eccentricity::rows(seeds.parse().unwrap_or_default()).map(|rows| println!("{}", eccentricity::table(&rows)))
        }
        ["axial", ref rest @ ..] if rest.len() <= 2 && sizes(rest, [200, 0]).is_some() => {
            let [campaigns, seed] = sizes(rest, [200, 0]).unwrap_or_default();
            axial(campaigns, seed)
        }
        ["consistency", ref rest @ ..] if rest.len() <= 3 && sizes(rest, [100, 1]).is_some() => {
            consistency_of_domains(sizes(rest, [100, 1]).unwrap_or_default(), rest.get(2).copied())
        }
        ["coverage"] => coverage(500),
        ["coverage", campaigns] if campaigns.parse::<u64>().is_ok() => coverage(campaigns.parse().unwrap_or_default()),
        ["value-coverage", ref rest @ ..] if rest.len() <= 3 && sizes(rest, [300, 0]).is_some() => {
            let [campaigns, seed] = sizes(rest, [300, 0]).unwrap_or_default();
            layout(rest.get(2)).and_then(|only| value_coverage(campaigns, seed, only))
        }
        ["wall-coverage", ref rest @ ..] if rest.len() <= 2 && sizes(rest, [200, 0]).is_some() => {
            let [walls, seed] = sizes(rest, [200, 0]).unwrap_or_default();
            wall_coverage(walls, seed)
        }
        ["blind", ref rest @ ..] if rest.len() <= 4 && sizes(rest, [240, 1]).is_some() => {
            let [campaigns, seed] = sizes(rest, [240, 1]).unwrap_or_default();
            layout(rest.get(3)).and_then(|only| blind(campaigns, seed, rest.get(2).copied(), only))
        }
        ["blind-campaign", ref rest @ ..] if (1..=3).contains(&rest.len()) && sizes(rest, [0, 1]).is_some() => {
            layout(rest.get(2)).and_then(|only| blind_campaign(sizes(rest, [0, 1]).unwrap_or_default(), only))
        }
        ["monte-carlo", ref rest @ ..] if rest.len() <= 1 && sizes(rest, [1000, 0]).is_some() => {
            monte_carlo(sizes(rest, [1000, 0]).unwrap_or_default()[0])
        }
        ["diagnose-scaling"] => scaling::rows().map(|rows| println!("{}", scaling::table(&rows))),
        ["compare-results", a, b] => compare_results(a, b, 1e-12),
        ["compare-results", a, b, relative] if relative.parse::<f64>().is_ok() => {
            compare_results(a, b, relative.parse().unwrap_or_default())
        }
        ["spatial-coverage", ref rest @ ..]
            if rest.len() <= 3
                && sizes(rest, [100, 1]).is_some()
                && rest.get(2).is_none_or(|word| word.parse::<usize>().is_ok()) =>
        {
            spatial_coverage(sizes(rest, [100, 1]).unwrap_or_default(), rest.get(2).and_then(|word| word.parse().ok()))
        }
        ["spatial-placement", ref rest @ ..] if rest.len() <= 2 && sizes(rest, [100, 1]).is_some() => {
            let [machines, seed] = sizes(rest, [100, 1]).unwrap_or_default();
            spatial_placement(machines, seed)
        }
        ["surface", pipeline, picture] => surface(pipeline, picture),
        ["component-errors", pipeline, picture] => {
            drawn(picture, points_pictures::component_errors(Path::new(pipeline), 'C'))
        }
        ["flat", pipeline, picture] => drawn(picture, flat::picture(Path::new(pipeline))),
        ["pretravel", pipeline, picture] => drawn(picture, points_pictures::pretravel(Path::new(pipeline))),
        ["straightness-traces", file] => straightness_traces(file),
        ["straightness", file, picture] => straightness(file, picture),
        ["minimum-zone-cylinder", ref rest @ ..] if rest.len() <= 2 && sizes(rest, [50, 200]).is_some() => {
            let [walls, starts] = sizes(rest, [50, 200]).unwrap_or_default();
            minimum_zone_cylinder(walls, starts as usize)
        }
        ["rotor"] => rotors(),
        ["campbell", rotor, picture, most_rpm, modes]
            if most_rpm.parse::<f64>().is_ok() && modes.parse::<usize>().is_ok() =>
        {
            campbell(rotor, picture, most_rpm.parse().unwrap_or_default(), modes.parse().unwrap_or_default())
        }
        ["averaging"] => averaging(None),
        ["averaging", picture] => averaging(Some(picture)),
        _ => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Takes `--domain NAME` out of the words; nothing where there is none, or where it is the spindle, which has a benchmark of its own.
fn consistency_of_domains([campaigns, seed]: [u64; 2], domain: Option<&str>) -> Result<()> {
    let mut rows = Vec::new();
    for kind in consistency::ROWS.iter().filter(|kind| domain.is_none_or(|domain| kind.domain.starts_with(domain))) {
        eprintln!("{}, {}", kind.domain, kind.trouble);
        let row = consistency::row(kind, campaigns, seed)?;
        row.falsely.iter().for_each(|said| eprintln!("  {said}"));
        rows.push((kind, row));
    }
    println!("{}", consistency::table(&rows));
    Ok(())
}

fn domain(words: &mut Vec<&str>) -> Result<Option<&'static Domain>> {
    let Some(place) = words.iter().position(|word| *word == "--domain") else { return Ok(None) };
    let name = words.get(place + 1).copied().unwrap_or_default();
    words.drain(place..(place + 2).min(words.len()));
    let found = domains::named(name);
    if found.is_none() && name != "spindle" {
        let known: Vec<&str> = std::iter::once("spindle").chain(domains::ALL.map(|domain| domain.name)).collect();
        return Err(Error::new("find the domain", name, format!("there are {}", known.join(", "))));
    }
    Ok(found)
}

fn monte_carlo(campaigns: u64) -> Result<()> {
    let all = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    let threads: Vec<usize> = (1..=all).filter(|threads| threads.is_power_of_two() || *threads == all).collect();
    println!("{}", monte_carlo::table(campaigns, &monte_carlo::rows(campaigns, &threads)?));
    Ok(())
}

fn averaging(picture: Option<&str>) -> Result<()> {
    let figure = averaging::study(&averaging::figure_7()?)?;
    println!("Fig. 7's settings, simulated: form and asynchronous motion only\n\n{}", figure.table());
    let table = averaging::study(&averaging::table_1()?)?;
    println!("Table 1's settings, simulated: with synchronous motion, eccentricity and noise\n\n{}", table.table());
    if let Some(path) = picture {
        let path = atomic_file::write(path, &figure.picture("Ra tends to the part's own (simulated)")?)?;
        println!("picture: {}", path.display());
    }
    Ok(())
}

fn campbell(path: &str, picture: &str, most_rpm: f64, modes: usize) -> Result<()> {
    let drawn = rotor::campbell(Path::new(path), most_rpm, modes, &[1.0, 2.0, 3.0])?;
    println!("picture: {}", atomic_file::write(picture, &drawn)?.display());
    Ok(())
}

fn rotors() -> Result<()> {
    println!("Slender beams, length/diameter 200 to 300\n\n{}", rotor::table(&rotor::beams()?, "closed form"));
    let peer = rotor::peer()?;
    let title = format!("Rotors of ross-rotordynamics {}, lateral modes", peer.version);
    println!("{title}\n\n{}", rotor::table(&peer.rows, "ross"));
    println!("Damping ratios\n\n{}", rotor::table(&peer.damping, "ross"));
    Ok(())
}

fn coverage(campaigns: u64) -> Result<()> {
    for setting in coverage::Setting::ALL {
        println!("{campaigns} campaigns, simulated: {}\n", setting.name());
        println!("{}", coverage::table(&coverage::rows(&setting.campaigns(0, campaigns))?));
    }
    Ok(())
}

fn axial(campaigns: u64, seed: u64) -> Result<()> {
    for layout in axial::Layout::ALL {
        println!("{campaigns} campaigns from seed {seed}, simulated: {}\n", layout.name());
        println!("{}", coverage::table(&axial::rows(&layout.campaigns(seed, campaigns))?));
    }
    Ok(())
}

fn value_coverage(campaigns: u64, seed: u64, only: Option<Layout>) -> Result<()> {
    let folder = tempfile::tempdir().map_err(|error| Error::caused("make", "a folder for recordings", error))?;
    for rig in values::RIGS.into_iter().filter(|rig| only.is_none_or(|only| only == *rig)) {
        for spectrum in Spectrum::ALL {
            println!("{campaigns} campaigns from seed {seed}, simulated: {}; {}\n", rig.name(), spectrum.name());
            println!("{}", values::table(&values::rows(rig, spectrum, seed..seed + campaigns, folder.path())?));
        }
    }
    Ok(())
}

fn spatial_coverage([machines, seed]: [u64; 2], places: Option<usize>) -> Result<()> {
    println!("{machines} machines from seed {seed}, simulated\n");
    println!("{}", spatial::table(&[spatial::coverage(machines as usize, seed, places)?]));
    Ok(())
}

fn spatial_placement(machines: u64, seed: u64) -> Result<()> {
    println!("{machines} machines from seed {seed}, simulated\n");
    println!("{}", spatial::placement::table(&spatial::placement::placements(machines, seed)?));
    Ok(())
}

fn wall_coverage(walls: u64, seed: u64) -> Result<()> {
    let folder = tempfile::tempdir().map_err(|error| Error::new("make", "a folder for points", error))?;
    for noise_um in [0.02, 0.1] {
        println!("{walls} walls from seed {seed}, simulated: noise of {noise_um} µm\n");
        println!("{}", values::table(&walls::rows(noise_um, seed..seed + walls, folder.path())?));
    }
    Ok(())
}

/// The layout of a word; none without one.
fn layout(word: Option<&&str>) -> Result<Option<Layout>> {
    let Some(word) = word else { return Ok(None) };
    let found = Layout::ALL.into_iter().find(|layout| layout.word() == *word);
    found.map(Some).ok_or_else(|| Error::new("read the arguments", *word, "expected four, six, reversed or paper"))
}

/// Two numbers, as far as they are given.
fn sizes(words: &[&str], [first, second]: [u64; 2]) -> Option<[u64; 2]> {
    let number = |place: usize, default| words.get(place).map_or(Some(default), |word| word.parse().ok());
    Some([number(0, first)?, number(1, second)?])
}

fn minimum_zone_cylinder(walls: u64, starts: usize) -> Result<()> {
    let mut rows = (0..walls).map(|seed| Wall::simulated(seed).study(starts)).collect::<Result<Vec<_>>>()?;
    let folder = std::env::var_os("RUNOUT_DATA").unwrap_or_else(|| "target/data".into());
    let measured = Path::new(&folder).join("zeiss-cylinder/cylinder-r15.csv");
    if measured.is_file() {
        rows.push(Wall::measured(&measured, 15.056)?.study(starts)?);
    } else {
        println!("{} is not there; `cargo xtask data` fetches it", measured.display());
    }
    println!("{}", minimum_zone_cylinder::table(&rows, starts));
    Ok(())
}

fn blind(campaigns: u64, seed: u64, file: Option<&str>, only: Option<Layout>) -> Result<()> {
    let start = std::time::Instant::now();
    let judged = blind::campaigns(campaigns, seed, only)?;
    let text = blind::report::report(&judged);
    let of = only.map(|layout| format!(", {}", layout.name())).unwrap_or_default();
    println!("{campaigns} campaigns of seed {seed}{of}, simulated\n\n{text}");
    if let Some(path) = file {
        let path = atomic_file::write(path, text.as_bytes())?;
        println!("written: {}", path.display());
    }
    eprintln!("in {:.0} s", start.elapsed().as_secs_f64());
    Ok(())
}

fn blind_campaign([index, seed]: [u64; 2], only: Option<Layout>) -> Result<()> {
    let judged = blind::judge::judge(blind::draw::campaign(seed, index, only))?;
    println!("{:?}: {}\n{:#?}", judged.campaign.rig, judged.planted(), judged.diagnosis);
    println!("{:#?}\n{:?}\n{:?}\n{}", judged.effects, judged.form, judged.failures(), judged.said());
    Ok(())
}

fn blind_points(domain: &Domain, [campaigns, seed]: [u64; 2], file: Option<&str>) -> Result<()> {
    let start = std::time::Instant::now();
    let text = blind::points::report::report(&blind::points::campaigns(domain, campaigns, seed)?);
    println!("{campaigns} campaigns of seed {seed}, {}, simulated\n\n{text}", domain.name);
    if let Some(path) = file {
        let path = atomic_file::write(path, text.as_bytes())?;
        println!("written: {}", path.display());
    }
    eprintln!("in {:.0} s", start.elapsed().as_secs_f64());
    Ok(())
}

fn blind_campaign_of_points(domain: &Domain, [index, seed]: [u64; 2]) -> Result<()> {
    let (kind, campaign) = blind::points::campaign(domain, seed, index)?;
    let judged = blind::points::judge::judge(index, kind, &campaign)?;
    println!("{}: {}\n{:#?}", judged.layout, judged.planted(), judged.diagnosis);
    println!("{:#?}\n{:?}\n{:?}\n{}", judged.effects, judged.values, judged.failures(), judged.said());
    Ok(())
}

fn compare_results(a: &str, b: &str, relative: f64) -> Result<()> {
    let found = results::compare(Path::new(a), Path::new(b), relative)?;
    println!("{}", found.report());
    if found.differ() { Err(Error::new("compare", format!("{a} and {b}"), "they differ")) } else { Ok(()) }
}

fn surface(pipeline: &str, picture: &str) -> Result<()> {
    let path = atomic_file::write(picture, &unrolled::picture(Path::new(pipeline))?)?;
    println!("picture: {}", path.display());
    Ok(())
}

fn drawn(path: &str, picture: Result<Vec<u8>>) -> Result<()> {
    let path = atomic_file::write(path, &picture?)?;
    println!("picture: {}", path.display());
    Ok(())
}

fn straightness_traces(file: &str) -> Result<()> {
    let path = atomic_file::write(file, straightness::traces()?.as_bytes())?;
    println!("traces: {}", path.display());
    Ok(())
}

fn straightness(file: &str, picture: &str) -> Result<()> {
    let result = straightness::separate(Path::new(file))?;
    println!("{}", straightness::table(&result));
    let path = atomic_file::write(picture, &straightness::picture(&result)?)?;
    println!("picture: {}", path.display());
    Ok(())
}
