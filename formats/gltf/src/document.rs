//! The JSON chunk.

use std::{collections::BTreeMap, io};

use gltf_json::{
    Accessor, Asset, Buffer, Index, Mesh, Node, Root, Scene,
    accessor::{ComponentType, GenericComponentType, Type},
    buffer::{Stride, Target, View},
    extras::RawValue,
    mesh::{Mode, Primitive, Semantic},
    validation::Checked::Valid,
};
use runout_mesh::Notes;

use crate::vertices::{COLOUR, DEVIATION, Layout, NORMAL, POSITION, STRIDE};

/// Describes the binary chunk. The notes are extras of the asset and of the mesh, so that programs which keep only one
/// of them keep the notes.
///
/// There is no material: readers such as trimesh take vertex colours only where there is none.
pub(crate) fn json(layout: &Layout, notes: &Notes) -> io::Result<Vec<u8>> {
    let extras: Option<Box<RawValue>> = Some(serde_json::value::to_raw_value(notes)?);
    let asset = Asset { extras: extras.clone(), generator: Some(notes.program.clone()), ..Asset::default() };
    let mut root = Root { asset, ..Root::default() };
    let buffer = root.push(Buffer {
        byte_length: (layout.vertex_bytes() + layout.index_bytes()).into(),
        name: None,
        uri: None,
        extensions: None,
        extras: None,
    });
    let vertices = root.push(View {
        buffer,
        byte_length: layout.vertex_bytes().into(),
        byte_offset: None,
        byte_stride: Some(Stride(STRIDE)),
        name: Some("vertices".into()),
        target: Some(Valid(Target::ArrayBuffer)),
        extensions: None,
        extras: None,
    });
    let triangles = root.push(View {
        buffer,
        byte_length: layout.index_bytes().into(),
        byte_offset: Some(layout.vertex_bytes().into()),
        byte_stride: None,
        name: Some("triangles".into()),
        target: Some(Valid(Target::ElementArrayBuffer)),
        extensions: None,
        extras: None,
    });
    let count = layout.vertices;
    let corner = |corner: [f32; 3]| Some(serde_json::Value::from(corner.map(f64::from).to_vec()));
    let position = root.push(Accessor {
        min: corner(layout.min),
        max: corner(layout.max),
        ..accessor(vertices, POSITION, count, ComponentType::F32, Type::Vec3)
    });
    let normal = root.push(accessor(vertices, NORMAL, count, ComponentType::F32, Type::Vec3));
    let colour =
        root.push(Accessor { normalized: true, ..accessor(vertices, COLOUR, count, ComponentType::U8, Type::Vec4) });
    let deviation = root.push(accessor(vertices, DEVIATION, count, ComponentType::F32, Type::Scalar));
    let indices = root.push(accessor(triangles, 0, layout.indices, ComponentType::U32, Type::Scalar));
    let primitive = Primitive {
        attributes: BTreeMap::from([
            (Valid(Semantic::Positions), position),
            (Valid(Semantic::Normals), normal),
            (Valid(Semantic::Colors(0)), colour),
            (Valid(Semantic::Extras("DEVIATION_UM".into())), deviation),
        ]),
        extensions: None,
        extras: None,
        indices: Some(indices),
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

fn accessor(view: Index<View>, offset: usize, count: usize, component: ComponentType, kind: Type) -> Accessor {
    Accessor {
        buffer_view: Some(view),
        byte_offset: Some(offset.into()),
        count: count.into(),
        component_type: Valid(GenericComponentType(component)),
        extensions: None,
        extras: None,
        type_: Valid(kind),
        min: None,
        max: None,
        name: None,
        normalized: false,
        sparse: None,
    }
}
