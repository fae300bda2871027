//! Straightness in a result file.

use hdf5_metno::{File, Result as Outcome};
use runout_core::{
    Result,
    atomic_file::PendingFile,
    pipeline::run::Summary,
    stage::StraightnessExporter,
    straightness::{CONVENTION, Straightness},
};

use super::{ResultExporter, complete, create};
use crate::node;

impl StraightnessExporter for ResultExporter {
    fn write(&self, result: &Straightness, summary: &Summary) -> Result<Vec<PendingFile>> {
        let pending = PendingFile::new(&self.path)?;
        let write = || -> Outcome<()> {
            let file = create(pending.path(), &summary.title, CONVENTION)?;
            table(&file, result)?;
            complete(&file, summary)
        };
        write().map_err(|error| pending.failure(error))?;
        Ok(vec![pending])
    }
}

fn table(file: &File, result: &Straightness) -> Outcome<()> {
    let group = file.create_group("straightness")?;
    let part = "the part's deviation from its least-squares line, outward positive";
    let slide = "the slide's deviation from its least-squares line, towards the part positive";
    let std_of =
        |name: &str| format!("standard uncertainty of {name} at this position, from the scatter; NaN if not known");
    let columns = [
        ("z_mm", "mm", "place along the axis".to_owned(), &result.z_mm),
        ("part_um", "um", part.to_owned(), &result.part_um),
        ("part_std_um", "um", std_of("part_um"), &result.part_std_um),
        ("slide_um", "um", slide.to_owned(), &result.slide_um),
        ("slide_std_um", "um", std_of("slide_um"), &result.slide_std_um),
    ];
    for (name, unit, meaning, values) in columns {
        let column = group.new_dataset_builder().with_data(values).create(name)?;
        node::put_text(&column, "unit", unit)?;
        node::put_text(&column, "meaning", &meaning)?;
    }
    Ok(())
}
