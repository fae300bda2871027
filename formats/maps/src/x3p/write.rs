//! How an X3P file is written: ISO 25178-72:2017, heights as f64 in a binary file, NaN where there is none.

use std::{
    fmt::Write as _,
    io::{self, Seek, Write},
};

use md5::{Digest, Md5};
use runout_core::{height_grid::HeightGrid, provenance};
use zip::{CompressionMethod, DateTime, ZipWriter, write::SimpleFileOptions};

use super::hex;
use crate::map::{MM_PER_M, NM_PER_M};

/// The date of files that have the same bytes for the same heights.
const DATE: &str = "2000-01-01T00:00:00Z";

/// Writes a map.
pub(crate) fn write(grid: &HeightGrid, title: &str, file: &mut (impl Write + Seek)) -> io::Result<()> {
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(DateTime::default());
    let large = options.large_file(8 * grid.height_nm.len() as u64 > u64::from(u32::MAX) / 2);
    let mut archive = ZipWriter::new(file);
    archive.start_file("bindata/data.bin", large)?;
    let mut hash = Md5::new();
    let mut block = Vec::with_capacity(8 * grid.columns);
    for row in grid.height_nm.chunks(grid.columns.max(1)) {
        block.clear();
        block.extend(row.iter().flat_map(|height_nm| (height_nm / NM_PER_M).to_le_bytes()));
        hash.update(&block);
        archive.write_all(&block)?;
    }
    let main = document(grid, title, &hex(&hash.finalize()));
    archive.start_file("main.xml", options)?;
    archive.write_all(main.as_bytes())?;
    archive.start_file("md5checksum.hex", options)?;
    archive.write_all(format!("{} *main.xml\n", hex(&Md5::digest(main.as_bytes()))).as_bytes())?;
    archive.finish()?.flush()
}

fn document(grid: &HeightGrid, title: &str, checksum: &str) -> String {
    let mut axes = String::new();
    let all = [("CX", grid.step_x_mm, grid.origin_x_mm), ("CY", grid.step_y_mm, grid.origin_y_mm)];
    for (name, step_mm, origin_mm) in all {
        let [increment, offset] = [step_mm, origin_mm].map(|length| length / MM_PER_M);
        let _ = write!(
            axes,
            "      <{name}>\n        <AxisType>I</AxisType>\n        <DataType>D</DataType>\n        <Increment>{increment:e}</Increment>\n        \
             <Offset>{offset:e}</Offset>\n      </{name}>\n"
        );
    }
    let feature = if grid.rows() == 1 { "PRF" } else { "SUR" };
    let (columns, rows) = (grid.columns, grid.rows());
    let creator = format!("runout {}", provenance::VERSION);
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<p:ISO5436_2 xmlns:p="http://www.opengps.eu/2008/ISO5436_2" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:schemaLocation="http://www.opengps.eu/2008/ISO5436_2 http://www.opengps.eu/2008/ISO5436_2/ISO5436_2.xsd">
  <Record1>
    <Revision>ISO5436 - 2000</Revision>
    <FeatureType>{feature}</FeatureType>
    <Axes>
{axes}      <CZ>
        <AxisType>A</AxisType>
        <DataType>D</DataType>
        <Increment>1</Increment>
        <Offset>0</Offset>
      </CZ>
    </Axes>
  </Record1>
  <Record2>
    <Date>{DATE}</Date>
    <Creator>{creator}</Creator>
    <Instrument>
      <Manufacturer>runout</Manufacturer>
      <Model>software</Model>
      <Serial>not applicable</Serial>
      <Version>{version}</Version>
    </Instrument>
    <CalibrationDate>{DATE}</CalibrationDate>
    <ProbingSystem>
      <Type>Software</Type>
      <Identification>{creator}</Identification>
    </ProbingSystem>
    <Comment>{title}</Comment>
  </Record2>
  <Record3>
    <MatrixDimension>
      <SizeX>{columns}</SizeX>
      <SizeY>{rows}</SizeY>
      <SizeZ>1</SizeZ>
    </MatrixDimension>
    <DataLink>
      <PointDataLink>bindata/data.bin</PointDataLink>
      <MD5ChecksumPointData>{checksum}</MD5ChecksumPointData>
    </DataLink>
  </Record3>
  <Record4>
    <ChecksumFile>md5checksum.hex</ChecksumFile>
  </Record4>
</p:ISO5436_2>
"#,
        version = provenance::VERSION,
        title = quick_xml::escape::escape(title)
    )
}
