//! Straightness of part and slide.

use runout_core::pipeline::run::StraightnessSummary;

use super::known;
use crate::render::{number::significant, page::Page, table::Table};

pub(super) fn section(page: &mut Page, found: &StraightnessSummary) {
    let [from, to] = found.z_mm.map(|z_mm| significant(z_mm, 5));
    let mut table = Table::new(1, ["", "STRt µm", "rms µm", "± µm"]);
    for (name, values) in [("part", &found.part), ("slide", &found.slide)] {
        table.row([
            name.to_owned(),
            significant(values.strt_um, 4),
            significant(values.rms_um, 4),
            known(values.std_um, 2),
        ]);
    }
    let about = "about the least-squares line (± is the standard uncertainty at one position)";
    page.headed_table(format_args!("Straightness {about}"), &table);
    page.line(format_args!("  {} positions, z {from} to {to} mm", found.points));
    if let Some(repeatability_um) = found.repeatability_um {
        page.line(format_args!("  one trace repeats to {} µm", significant(repeatability_um, 2)));
    }
}
