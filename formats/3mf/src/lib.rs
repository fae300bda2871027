//! 3MF meshes (3MF Core Specification 1.3), for printing.
//!
//! Millimetres, z along the spindle, or upwards on a height map, as measured; colours of triangles by deviation, as base materials of the
//! palette. The specification asks for solids: `capped = true` makes one of a part. Where a magnified mesh is asked for, it is a second
//! file (`NAME-x1000.3mf`).

use std::{
    fs::File,
    io::{self, BufWriter, Seek, Write},
};

use quick_xml::escape::escape;
use runout_core::pipeline::Registry;
use runout_mesh::{Format, Mesh, Notes, UNMEASURED, palette};
use zip::{ZipWriter, write::SimpleFileOptions};

/// Adds the exporter `3mf`.
pub fn register(registry: &mut Registry) {
    let about = "writes the surface as a 3MF mesh in mm, coloured by deviation, for printing";
    Format { name: "3mf", about, extension: "3mf", unit: "mm", write }.register(registry);
}

const CONTENT_TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
"#;

const RELATIONSHIPS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
"#;

fn write(mesh: &Mesh, notes: &Notes, file: &mut File) -> io::Result<()> {
    let mut archive = ZipWriter::new(BufWriter::new(file));
    // Equal runs give equal bytes: no time of writing.
    let options = SimpleFileOptions::default().last_modified_time(zip::DateTime::default()).large_file(true);
    for (name, contents) in [("[Content_Types].xml", CONTENT_TYPES), ("_rels/.rels", RELATIONSHIPS)] {
        archive.start_file(name, options)?;
        archive.write_all(contents.as_bytes())?;
    }
    archive.start_file("3D/3dmodel.model", options)?;
    model(mesh, notes, &mut BufWriter::new(&mut archive))?;
    finished(archive)
}

fn finished<W: Write + Seek>(archive: ZipWriter<W>) -> io::Result<()> {
    archive.finish()?.flush()
}

fn model(mesh: &Mesh, notes: &Notes, to: &mut impl Write) -> io::Result<()> {
    writeln!(to, r#"<?xml version="1.0" encoding="UTF-8"?>"#)?;
    writeln!(
        to,
        r#"<model unit="millimeter" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">"#
    )?;
    let lines: String = notes.lines().join("\n").chars().map(allowed).collect();
    for (name, text) in [("Title", &notes.title), ("Application", &notes.program), ("Description", &lines)] {
        let text: String = text.chars().map(allowed).collect();
        writeln!(to, "<metadata name=\"{name}\">{}</metadata>", escape(text.as_str()))?;
    }
    writeln!(to, "<resources>\n<basematerials id=\"1\">")?;
    let colours = palette();
    for [red, green, blue] in colours.iter().chain([&UNMEASURED]) {
        writeln!(to, "<base name=\"deviation\" displaycolor=\"#{red:02X}{green:02X}{blue:02X}\"/>")?;
    }
    writeln!(
        to,
        "</basematerials>\n<object id=\"2\" type=\"{}\" pid=\"1\" pindex=\"{}\">\n<mesh>\n<vertices>",
        // A sheet is no solid.
        if mesh.wall().is_some_and(|wall| !wall.caps().is_empty()) { "model" } else { "surface" },
        colours.len() / 2
    )?;
    let mut places: Vec<u16> = Vec::with_capacity(mesh.counts()[0]);
    mesh.vertices(|vertex| {
        places.push(vertex.colour.unwrap_or(colours.len()) as u16);
        let [x, y, z] = vertex.position_mm.map(|place| place as f32);
        writeln!(to, "<vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>")
    })?;
    writeln!(to, "</vertices>\n<triangles>")?;
    mesh.triangles(|[a, b, c]| {
        // A triangle of the cap, which has a vertex that was not measured, is no deviation.
        let of = [a, b, c].map(|vertex| places[vertex as usize]);
        let place = of.into_iter().max().filter(|place| usize::from(*place) == colours.len()).unwrap_or(of[0]);
        writeln!(to, "<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\" pid=\"1\" p1=\"{place}\"/>")
    })?;
    writeln!(to, "</triangles>\n</mesh>\n</object>\n</resources>")?;
    writeln!(to, "<build>\n<item objectid=\"2\"/>\n</build>\n</model>")?;
    to.flush()
}

/// XML has no other control characters.
fn allowed(character: char) -> char {
    if character.is_control() && character != '\n' { ' ' } else { character }
}
