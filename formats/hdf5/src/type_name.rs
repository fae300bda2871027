//! Types in words.

use hdf5_metno::types::TypeDescriptor;

/// A type in words.
pub(crate) fn type_name(descriptor: &TypeDescriptor) -> String {
    let bits = |size: usize| 8 * size;
    match descriptor {
        TypeDescriptor::Integer(size) => format!("i{}", bits(*size as usize)),
        TypeDescriptor::Unsigned(size) => format!("u{}", bits(*size as usize)),
        TypeDescriptor::Float(size) => format!("f{}", bits(*size as usize)),
        TypeDescriptor::Boolean => "booleans".into(),
        TypeDescriptor::Enum(_) => "an enumeration".into(),
        TypeDescriptor::Compound(_) => "a compound type".into(),
        TypeDescriptor::FixedAscii(_)
        | TypeDescriptor::FixedUnicode(_)
        | TypeDescriptor::VarLenAscii
        | TypeDescriptor::VarLenUnicode => "text".into(),
        _ => "another type".into(),
    }
}
