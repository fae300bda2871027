//! Wavefront OBJ meshes.
//!
//! Millimetres, z along the spindle as measured. Vertices carry their colour (sRGB, 0 to 1) after their position, as
//! MeshLab reads it. Where a magnified mesh is asked for, it is a second file (`NAME-x1000.obj`).

mod text;

use std::{
    fs::File,
    io::{self, Write},
    num::NonZeroUsize,
    sync::mpsc::sync_channel,
    thread,
};

use runout_core::{
    pipeline::{
        error::Fault,
        registry::{Context, Plugin, Registry, StageConfig},
    },
    stage::Exporter,
};
use runout_mesh::{COLOUR_STEPS, Format, Mesh, MeshConfig, Notes, UNMEASURED, palette};
use schemars::JsonSchema;
use serde::Deserialize;

use text::Text;

/// The exporter `obj`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct ObjConfig(MeshConfig);

impl StageConfig for ObjConfig {
    type Stage = Box<dyn Exporter>;

    const NAME: &'static str = "obj";
    const ABOUT: &'static str = "writes the surface as a Wavefront OBJ mesh in mm, coloured by deviation";

    fn check(self, context: &Context) -> Result<Self::Stage, Fault> {
        self.0.check(context, Format { extension: "obj", unit: "mm", write })
    }
}

/// Adds the exporter `obj`.
pub fn register(registry: &mut Registry) {
    registry.exporters.add(Plugin::of::<ObjConfig>());
}

/// Rings that one thread writes out at a time: a megabyte of text with 2560 angles.
const TOGETHER: usize = 4;
/// Portions of text that wait for the file, a thread.
const WAITING: usize = 2;

/// Writes comments, vertices with their normals ring by ring, and triangles band by band.
///
/// A cap shares the rim's vertices, so that the solid is closed by its very indices, and has a normal of its own.
fn write(mesh: &Mesh, notes: &Notes, file: &mut File) -> io::Result<()> {
    let mut text = Text::default();
    for line in notes.lines() {
        text.raw("# ").raw(&line).raw("\n");
    }
    text.raw("# axes: z along the spindle, x at the part's 0 deg\n");
    text.raw("o ").raw(&object_name(&notes.title)).raw("\n");
    file.write_all(text.bytes())?;
    let colours: [String; COLOUR_STEPS] = palette().map(colour_text);
    in_order(mesh.rings(), file, |ring, text| {
        mesh.ring(ring, |vertex| {
            text.raw("v").vector(vertex.position_mm).raw(&colours[vertex.colour]);
            text.raw("vn").vector(vertex.normal).raw("\n");
        });
    })?;
    let caps = mesh.caps();
    let mut text = Text::default();
    for cap in &caps {
        text.raw("v").vector([0.0, 0.0, cap.z_mm]).raw(&colour_text(UNMEASURED));
        text.raw("vn").vector([0.0, 0.0, cap.normal_z]).raw("\n");
    }
    file.write_all(text.bytes())?;
    in_order(mesh.rings() - 1, file, |ring, text| {
        for triangle in mesh.band(ring).flatten() {
            // OBJ counts from 1.
            let [a, b, c] = triangle.map(|vertex| vertex + 1);
            text.raw("f").corner(a, a).corner(b, b).corner(c, c).raw("\n");
        }
    })?;
    let mut text = Text::default();
    let angles = mesh.angles() as u32;
    let wall = mesh.rings() as u32 * angles;
    for (index, cap) in caps.iter().enumerate() {
        let centre = wall + index as u32;
        for triangle in cap.triangles(angles, centre, cap.ring as u32 * angles) {
            let [a, b, c] = triangle.map(|vertex| vertex + 1);
            text.raw("f").corner(a, centre + 1).corner(b, centre + 1).corner(c, centre + 1).raw("\n");
        }
    }
    file.write_all(text.bytes())
}

/// Writes what `write` makes of each of `count` rings, one after the other, made on all processors.
fn in_order(count: usize, to: &mut impl Write, write: impl Fn(usize, &mut Text) + Sync) -> io::Result<()> {
    let portions = count.div_ceil(TOGETHER);
    let workers = thread::available_parallelism().map_or(1, NonZeroUsize::get).clamp(1, portions.max(1));
    thread::scope(|scope| {
        let made = (0..workers).map(|first| {
            let (sender, receiver) = sync_channel(WAITING);
            let write = &write;
            scope.spawn(move || {
                for portion in (first..portions).step_by(workers) {
                    let mut text = Text::default();
                    (portion * TOGETHER..count.min((portion + 1) * TOGETHER)).for_each(|ring| write(ring, &mut text));
                    // Nobody takes it where the file has failed.
                    if sender.send(text).is_err() {
                        return;
                    }
                }
            });
            receiver
        });
        let made: Vec<_> = made.collect();
        (0..portions).try_for_each(|portion| {
            let text =
                made[portion % workers].recv().map_err(|_| io::Error::other("a thread that makes text stopped"))?;
            to.write_all(text.bytes())
        })
    })
}

/// Names of objects hold no blanks.
fn object_name(title: &str) -> String {
    let name: String =
        title.chars().map(|letter| if letter.is_whitespace() || letter.is_control() { '_' } else { letter }).collect();
    if name.is_empty() { "surface".into() } else { name }
}

/// " r g b" and the line's end; four digits keep every one of 256 steps apart.
fn colour_text(srgb: [u8; 3]) -> String {
    let [r, g, b] = srgb.map(|channel| f64::from(channel) / 255.0);
    format!(" {r:.4} {g:.4} {b:.4}\n")
}
