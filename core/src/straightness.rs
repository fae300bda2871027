//! Straightness along an axis: of a part, and of the slide that carried the probe.

/// What the numbers are, for files that explain themselves.
pub const CONVENTION: &str = "Straightness along z about the least-squares line (LSLI, ISO 12780-1). part_um is \
    positive where the part stands out towards the probe; slide_um is the slide's displacement towards the part in the \
    initial setup. Standard uncertainties are those of one position, from the scatter of repeated traces; NaN if not \
    known.";

/// What the readings cannot tell, whatever the data.
pub const LIMIT: &str = "each trace has an offset and a slope of its own, so only the straightness about the \
    least-squares line is known: neither taper, nor parallelism, nor the angle between slide and part";

/// Straightness of part and slide on common positions.
#[derive(Debug, Clone, PartialEq)]
pub struct Straightness {
    /// Ascending positions along the axis, in mm.
    pub z_mm: Vec<f64>,
    /// Deviation of the part from its least-squares line at each position, outward positive, in µm.
    pub part_um: Vec<f64>,
    /// Its standard uncertainty from the scatter of repeated traces; NaN where not known.
    pub part_std_um: Vec<f64>,
    /// Deviation of the slide from its least-squares line, towards the part of the initial setup positive, in µm.
    pub slide_um: Vec<f64>,
    /// Its standard uncertainty; NaN where not known.
    pub slide_std_um: Vec<f64>,
    /// Standard deviation of one trace at one position (root mean square over the positions), in µm; NaN without repeats.
    pub repeatability_um: f64,
    /// Degrees of freedom behind each position's standard uncertainty.
    pub degrees_of_freedom: usize,
    /// What the user should know.
    pub warnings: Vec<String>,
}
