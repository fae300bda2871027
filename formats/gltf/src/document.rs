//! The JSON chunk.

use std::{collections::BTreeMap, io, ops::Range};

use gltf_json::{
    Accessor, Asset, Buffer, Mesh, Node, Root, Scene,
    accessor::{ComponentType, GenericComponentType, Type},
    buffer::{Target, View},
    extras::RawValue,
    mesh::{Mode, Primitive, Semantic},
    validation::Checked::Valid,
};
use runout_mesh::Notes;

use crate::vertices::{Bounds, Layout};

/// Describes the binary chunk. The notes are extras of the asset and of the mesh, so that programs which keep only one
/// of them keep the notes.
///
/// There is no material: readers such as trimesh take vertex colours only where there is none.
pub fn json(layout: &Layout, bounds: &Bounds, notes: &Notes) -> io::Result<Vec<u8>> {
    let extras: Option<Box<RawValue>> = Some(serde_json::value::to_raw_value(notes)?);
    let mut root = Root {
        asset: Asset {
            copyright: None,
            extensions: None,
            extras: extras.clone(),
            generator: Some(notes.program.clone()),
            min_version: None,
            version: "2.0".into(),
        },
        ..Root::default()
    };
    let buffer =
        root.push(Buffer { byte_length: layout.bytes().into(), name: None, uri: None, extensions: None, extras: None });
    let mut describe = |part: &Part| {
        let view = root.push(View {
            buffer,
            byte_length: part.bytes.len().into(),
            byte_offset: Some(part.bytes.start.into()),
            byte_stride: None,
            name: Some(part.name.into()),
            target: Some(Valid(part.target)),
            extensions: None,
            extras: None,
        });
        let corner = |corner: [f32; 3]| serde_json::Value::from(corner.map(f64::from).to_vec());
        root.push(Accessor {
            buffer_view: Some(view),
            byte_offset: None,
            count: part.count.into(),
            component_type: Valid(GenericComponentType(part.component)),
            extensions: None,
            extras: None,
            type_: Valid(part.kind),
            min: part.bounds.map(|bounds| corner(bounds.min)),
            max: part.bounds.map(|bounds| corner(bounds.max)),
            name: Some(part.name.into()),
            normalized: part.component == ComponentType::U8,
            sparse: None,
        })
    };
    let attribute = |name, bytes, component, kind, bounds| Part {
        name,
        bytes,
        count: layout.vertices,
        component,
        kind,
        target: Target::ArrayBuffer,
        bounds,
    };
    let positions = attribute("position", layout.positions(), ComponentType::F32, Type::Vec3, Some(bounds));
    let normals = attribute("normal", layout.normals(), ComponentType::F32, Type::Vec3, None);
    let colours = attribute("colour", layout.colours(), ComponentType::U8, Type::Vec4, None);
    let deviations = attribute("deviation_um", layout.deviations(), ComponentType::F32, Type::Scalar, None);
    let triangles = Part {
        name: "triangles",
        bytes: layout.triangles(),
        count: layout.indices,
        component: ComponentType::U32,
        kind: Type::Scalar,
        target: Target::ElementArrayBuffer,
        bounds: None,
    };
    let attributes = BTreeMap::from([
        (Valid(Semantic::Positions), describe(&positions)),
        (Valid(Semantic::Normals), describe(&normals)),
        (Valid(Semantic::Colors(0)), describe(&colours)),
        (Valid(Semantic::Extras("DEVIATION_UM".into())), describe(&deviations)),
    ]);
    let indices = Some(describe(&triangles));
    let primitive = Primitive {
        attributes,
        extensions: None,
        extras: None,
        indices,
        material: None,
        mode: Valid(Mode::Triangles),
        targets: None,
    };
    let mesh = root.push(Mesh {
        extensions: None,
        extras,
        name: Some(notes.title.clone()),
        primitives: vec![primitive],
        weights: None,
    });
    let node = root.push(Node { mesh: Some(mesh), name: Some(notes.title.clone()), ..Node::default() });
    let scene = root.push(Scene { extensions: None, extras: None, name: None, nodes: vec![node] });
    root.scene = Some(scene);
    Ok(root.to_vec()?)
}

/// A stretch of the binary chunk.
struct Part<'a> {
    name: &'static str,
    bytes: Range<usize>,
    count: usize,
    component: ComponentType,
    kind: Type,
    target: Target,
    bounds: Option<&'a Bounds>,
}
