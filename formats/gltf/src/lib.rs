//! glTF binary meshes.
