//! Version 4: a header of five whole numbers, a name and a matrix, one after the other.

use runout_core::{Result, input_file::InputFile};

use super::{Matrix, Variables, bytes_of};
use crate::{
    bytes::{Bytes, text},
    channel::Kind,
    strided::Run,
};

/// Longest name of a variable.
const LONGEST_NAME: u32 = 64;
const TEXT: u32 = 1;

/// The type of a header: thousands say the order of bytes, tens the numbers, ones what they are.
fn type_of(code: u32, is_big_endian: bool) -> Option<(Kind, u32)> {
    let (order, reserved, number, content) = (code / 1000, code / 100 % 10, code / 10 % 10, code % 10);
    let kind = match number {
        0 => Kind::F64,
        1 => Kind::F32,
        2 => Kind::I32,
        3 => Kind::I16,
        4 => Kind::U16,
        5 => Kind::U8,
        _ => return None,
    };
    (order == u32::from(is_big_endian) && reserved == 0 && content <= 2).then_some((kind, content))
}

/// The order of bytes of the header that begins here.
fn order_of(head: &[u8]) -> Option<bool> {
    let code = *head.first_chunk::<4>()?;
    [false, true]
        .into_iter()
        .find(|big| type_of(if *big { u32::from_be_bytes(code) } else { u32::from_le_bytes(code) }, *big).is_some())
}

pub(super) fn recognises(head: &[u8]) -> bool {
    let Some(is_big_endian) = order_of(head) else { return false };
    let number = |at: usize| {
        let bytes = head.get(at..)?.first_chunk::<4>()?;
        Some(if is_big_endian { u32::from_be_bytes(*bytes) } else { u32::from_le_bytes(*bytes) })
    };
    let (Some(is_complex), Some(length)) = (number(12), number(16)) else { return false };
    let name = head.get(20..20 + (length.min(LONGEST_NAME) as usize)).unwrap_or_default();
    let is_name = |(last, rest): (&u8, &[u8])| {
        *last == 0 && rest.iter().all(|byte| byte.is_ascii_alphanumeric() || *byte == b'_')
    };
    is_complex <= 1 && (2..=LONGEST_NAME).contains(&length) && name.split_last().is_some_and(is_name)
}

pub(super) fn open(input: &InputFile) -> Result<Variables> {
    let mut variables = Variables::of(input.into());
    let mut bytes = Bytes::open(&input.into())?;
    while bytes.rest() > 0 {
        let code: [u8; 4] = bytes.array()?;
        let Some(is_big_endian) = order_of(&code) else {
            return Err(
                bytes.damaged(format!("expected the header of a matrix, found the type {}", u32::from_le_bytes(code)))
            );
        };
        bytes.is_big_endian = is_big_endian;
        let code = if is_big_endian { u32::from_be_bytes(code) } else { u32::from_le_bytes(code) };
        let Some((kind, content)) = type_of(code, is_big_endian) else {
            return Err(bytes.damaged(format!("expected the header of a matrix, found the type {code}")));
        };
        let [rows, columns] = [bytes.u32()?, bytes.u32()?].map(u64::from);
        let (is_complex, length) = (bytes.u32()? != 0, bytes.u32()?);
        let name = text(&bytes.take(length.into())?);
        let shape = vec![rows, columns];
        let size = bytes_of(&shape, kind.bytes() as u64);
        let Some(size) = size.filter(|size| *size <= bytes.rest()) else {
            return Err(
                bytes.damaged(format!("`{name}`: {rows} by {columns} numbers were declared, the file ends before"))
            );
        };
        let begin = bytes.place();
        match content {
            0 => {
                let first = Run::dense(begin, 1, kind, is_big_endian);
                variables.add(&Matrix { group: String::new(), name: name.clone(), shape, kind, first });
            }
            TEXT if size <= crate::bytes::LONGEST => {
                let width = kind.bytes();
                let place = |character: &[u8]| if is_big_endian { character[width - 1] } else { character[0] };
                let characters: Vec<u8> = if kind == Kind::F64 {
                    let number = |bytes: &[u8]| {
                        let bytes = bytes.first_chunk().copied().unwrap_or_default();
                        (if is_big_endian { f64::from_be_bytes(bytes) } else { f64::from_le_bytes(bytes) }) as u8
                    };
                    bytes.take(size)?.chunks(width).map(number).collect()
                } else {
                    bytes.take(size)?.chunks(width).map(place).collect()
                };
                variables.add_text("", &name, Some(text(&characters)));
            }
            _ => variables.add_text("", &name, None),
        }
        if is_complex {
            variables.remarks.push(format!("{}: `{name}` is complex: its real part is read", input.path().display()));
        }
        bytes.seek(begin.saturating_add(size.saturating_mul(1 + u64::from(is_complex))))?;
    }
    Ok(variables)
}
