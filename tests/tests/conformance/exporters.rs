//! What every exporter must do with the tables, values and surface of a run.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use runout_core::pipeline::{
    Registry,
    run::{Silent, run_alone},
};
use toml::{Table, Value};

use crate::{
    campaign::{self, Campaign},
    changed::{Between, Change, Taken},
    table::{Check, Kind, TestOutcome, on_two_threads},
};

const CHECKS: [Check; 5] = [
    Check("equal", "Equal results give equal files, byte by byte."),
    Check("pieces", "Rows in pieces of any length give the same files."),
    Check("files", "The files are those that were named before the run, and the summary."),
    Check("blocked", "A place that cannot be written to is an error that names it."),
    Check("whole", "Where the run fails after all rows, no file is there."),
];

pub(crate) fn test(registry: &Arc<Registry>) -> Kind {
    let campaigns = campaign::campaigns("export");
    let names = registry.exporters.iter().map(|plugin| plugin.name);
    Kind {
        heading: "Exporters",
        about: "Each writes the result of a shaft of three stations in two sections, with its surface; `controller` that of an R-test.",
        checks: &CHECKS,
        plugins: on_two_threads(names, |plugin| {
            let elsewhere = campaigns.get(plugin).and_then(|table| table.get("elsewhere")).and_then(Value::as_str);
            if let Some(why) = elsewhere {
                return CHECKS.iter().map(|_| TestOutcome::Exempt(why.to_owned())).collect();
            }
            let exporter = Exported::new(&campaigns, plugin, registry);
            let found = CHECKS.iter().map(|check| match &exporter {
                Ok(exporter) => exporter.found(check.0),
                Err(why) => TestOutcome::Fails(why.clone()),
            });
            found.collect()
        }),
    }
}

struct Exported {
    campaign: Campaign,
    /// `[[export]]` and what belongs to it.
    text: String,
    folder: PathBuf,
    /// Checks that do not apply, with the reason.
    exempt: Table,
}

type Files = BTreeMap<PathBuf, Vec<u8>>;

impl Exported {
    fn new(campaigns: &Table, plugin: &str, registry: &Arc<Registry>) -> Result<Self, String> {
        let mut keys = campaign::campaign_of(campaigns, "export", plugin)?;
        let exempt = keys.remove("exempt").and_then(|exempt| exempt.as_table().cloned()).unwrap_or_default();
        let of = keys.remove("of").and_then(|of| of.as_str().map(str::to_owned));
        let of = of.unwrap_or_else(|| "four-sensor-reversal".into());
        let mut table = campaign::campaign_of(&campaign::campaigns("separate"), "separate", &of)?;
        if let Some(Value::Table(more)) = keys.remove("separate") {
            let separate = table.entry("separate").or_insert_with(|| Table::new().into());
            separate.as_table_mut().ok_or("`separate` is no table")?.extend(more);
        }
        keys.insert("plugin".into(), plugin.into());
        let mut text = Table::from_iter([("export".to_owned(), Value::Array(vec![keys.into()]))]);
        if table.contains_key("rig") {
            let surface = "surface = { angles = 36, step_mm = 5 }";
            text.extend(surface.parse::<Table>().map_err(|error| error.to_string())?);
        }
        let campaign = Campaign::new(table, &of, Arc::clone(registry))?;
        let folder = campaign.folder().to_owned();
        Ok(Self { campaign, text: text.to_string(), folder, exempt })
    }

    fn found(&self, check: &str) -> TestOutcome {
        match (self.exempt.get(check).and_then(Value::as_str), self.check(check)) {
            (None, found) => found.into(),
            (Some(_), Ok(())) => TestOutcome::Fails("it holds: take away the exemption".into()),
            (Some(why), Err(_)) => TestOutcome::Exempt(why.to_owned()),
        }
    }

    fn check(&self, check: &str) -> Result<(), String> {
        match check {
            "equal" => differ(&self.written(None, false)?, &self.written(None, false)?),
            "pieces" => {
                let whole = self.written(None, false)?;
                [1, 7].into_iter().try_for_each(|piece| differ(&whole, &self.written(Some(piece), false)?))
            }
            "files" => self.as_announced(),
            "blocked" => self.is_blocked(),
            _ => match self.written(None, true) {
                Ok(_) => Err("the run does not fail".into()),
                Err(_) => match files(&self.folder.join("out")).into_keys().next() {
                    Some(file) => Err(format!("{} is left", file.display())),
                    None => Ok(()),
                },
            },
        }
    }

    /// The files of a run, whose exporter gets so many rows at a time.
    fn written(&self, piece: Option<usize>, fails: bool) -> Result<Files, String> {
        let out = self.folder.join("out");
        let _is_not_there = fs::remove_dir_all(&out);
        let mut pipeline = self.campaign.pipeline(&Change::default(), &self.text)?;
        let between = |inner, fails| Box::new(Between { inner, taken: Taken::default(), piece, fails });
        let inner = pipeline.exporters.pop();
        pipeline.exporters = vec![between(inner, false), between(None, fails)]
            .into_iter()
            .map(|exporter| exporter as Box<dyn runout_core::stage::Exporter>)
            .collect();
        run_alone(&pipeline, &Silent).map_err(|error| error.to_string())?;
        Ok(files(&out))
    }

    fn as_announced(&self) -> Result<(), String> {
        let written = self.written(None, false)?;
        let pipeline = self.campaign.pipeline(&Change::default(), &self.text)?;
        let mut announced: Vec<PathBuf> = pipeline.outputs();
        announced.extend(pipeline.summary_path());
        let stranger = written.keys().find(|file| !announced.contains(file));
        if let Some(file) = stranger {
            return Err(format!("{} is not announced", file.display()));
        }
        let first = pipeline.outputs().into_iter().next().ok_or("it names no file")?;
        if written.contains_key(&first) { Ok(()) } else { Err(format!("{} is not written", first.display())) }
    }

    /// A file is where the folder has to be.
    fn is_blocked(&self) -> Result<(), String> {
        let out = self.folder.join("out");
        let _is_not_there = fs::remove_dir_all(&out);
        fs::write(&out, "a file").map_err(|error| error.to_string())?;
        let ran = self
            .campaign
            .pipeline(&Change::default(), &self.text)
            .and_then(|pipeline| run_alone(&pipeline, &Silent).map(|_| ()).map_err(|error| error.to_string()));
        fs::remove_file(&out).map_err(|error| error.to_string())?;
        match ran {
            Ok(()) => Err("a file is where the folder has to be, and the run does not fail".into()),
            Err(words) if words.contains("out") => Ok(()),
            Err(words) => Err(format!("the error does not name the place: {words}")),
        }
    }
}

fn differ(one: &Files, other: &Files) -> Result<(), String> {
    if one.is_empty() {
        return Err("no file is written".into());
    }
    if !one.keys().eq(other.keys()) {
        return Err(format!("other files: {:?} and {:?}", one.keys(), other.keys()));
    }
    let unlike = one.iter().zip(other).find(|((_, a), (_, b))| a != b);
    unlike.map_or(Ok(()), |((file, _), _)| Err(format!("{} differs", file.display())))
}

/// All files below a folder.
fn files(folder: &Path) -> Files {
    let mut found = Files::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.insert(path.clone(), fs::read(&path).unwrap_or_default());
        }
    }
    found
}
