//! Calls of the C library that the `hdf5-metno` crate does not have, or not for all files.
#![allow(unsafe_code, reason = "calls of a C library")]

use std::{
    ffi::{CString, c_char, c_int, c_void},
    ops::Range,
    sync::Once,
};

use hdf5_metno::{Container, Dataset, Datatype, Group, plist::DatasetCreate, sync::sync, types::VarLenUnicode};
use hdf5_metno_sys::{
    h5::hsize_t,
    h5a::H5Aread,
    h5d::H5Dread,
    h5i::{H5I_type_t, H5Iget_type, hid_t},
    h5l::H5Lget_val,
    h5p::{H5P_DEFAULT, H5Pget_virtual_count, H5Pget_virtual_dsetname, H5Pget_virtual_filename},
    h5pl::H5PLset_loading_state,
    h5s::{H5S_ALL, H5S_seloper_t, H5Sclose, H5Screate_simple, H5Sselect_hyperslab},
    h5t::{
        H5T_IEEE_F32BE, H5T_IEEE_F32LE, H5T_IEEE_F64BE, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, H5T_STD_I8BE, H5T_STD_I8LE,
        H5T_STD_I16BE, H5T_STD_I16LE, H5T_STD_I32BE, H5T_STD_I32LE, H5T_STD_I64BE, H5T_STD_I64LE, H5T_STD_U8BE,
        H5T_STD_U8LE, H5T_STD_U16BE, H5T_STD_U16LE, H5T_STD_U32BE, H5T_STD_U32LE, H5T_STD_U64BE, H5T_STD_U64LE,
        H5T_bkg_t, H5T_cdata_t, H5T_class_t, H5T_cmd_t, H5T_pers_t, H5Tclose, H5Tcreate, H5Tequal, H5Tget_size,
        H5Tinsert, H5Tregister,
    },
};

/// Bytes of a reference to a text of variable length as a file holds it: its length in 4 bytes, the address of its heap in 8, its number there in 4
/// (HDF5 File Format Specification 3.0, IV.B).
const REFERENCE: usize = 16;
/// Bytes of a link's value: names of files and paths are shorter.
const LONGEST_VALUE: usize = 8192;

/// Keeps the library from loading filters as programs from `HDF5_PLUGIN_PATH` or the folder it was built with: what a file names is
/// not to be run.
pub(crate) fn forbid_plugins() {
    static ONCE: Once = Once::new();
    // SAFETY: the C function takes a mask by value (`unsigned int`), which the binding declares as a pointer; a null pointer is the mask
    // 0, no plugins of any kind. Nothing is dereferenced.
    ONCE.call_once(|| {
        sync(|| unsafe { H5PLset_loading_state(std::ptr::null_mut()) });
    });
}

/// Whether a type is a standard one of numbers, in either order of bytes.
pub(crate) fn is_standard(stored: &Datatype) -> bool {
    let standard = sync(|| {
        [
            *H5T_IEEE_F32LE,
            *H5T_IEEE_F32BE,
            *H5T_IEEE_F64LE,
            *H5T_IEEE_F64BE,
            *H5T_STD_I8LE,
            *H5T_STD_I8BE,
            *H5T_STD_I16LE,
            *H5T_STD_I16BE,
            *H5T_STD_I32LE,
            *H5T_STD_I32BE,
            *H5T_STD_I64LE,
            *H5T_STD_I64BE,
            *H5T_STD_U8LE,
            *H5T_STD_U8BE,
            *H5T_STD_U16LE,
            *H5T_STD_U16BE,
            *H5T_STD_U32LE,
            *H5T_STD_U32BE,
            *H5T_STD_U64LE,
            *H5T_STD_U64BE,
        ]
    });
    // SAFETY: both are types that live, those of the library as long as it; the call is guarded by its lock.
    standard.into_iter().any(|standard| sync(|| unsafe { H5Tequal(stored.id(), standard) }) > 0)
}

/// The value of a soft or external link: a path; or flags, a file and a path, each ended by NUL (HDF5 reference, H5Lget_val and
/// H5Lunpack_elink_val). `None` where there is none, or it is too long.
pub(crate) fn link_value(group: &Group, name: &str) -> Option<Vec<u8>> {
    let name = CString::new(name).ok()?;
    let mut value = vec![0_u8; LONGEST_VALUE];
    // SAFETY: the name is ended by NUL, the buffer as long as said, and both outlive the call, which the library's lock guards.
    let status = sync(|| unsafe {
        H5Lget_val(group.id(), name.as_ptr(), value.as_mut_ptr().cast(), LONGEST_VALUE, H5P_DEFAULT)
    });
    // A longer value fills the buffer to its end.
    (status >= 0 && value.last() == Some(&0)).then_some(value)
}

/// The sources of a virtual data set, `(file, data set)`, `.` for the same file; `None` where they cannot be read. The crate reads their
/// selections with them, not all of which it knows.
pub(crate) fn virtual_sources(settings: &DatasetCreate) -> Option<Vec<(String, String)>> {
    let mut count = 0;
    // SAFETY: the property list lives, the number outlives the call, which the library's lock guards.
    let status = sync(|| unsafe { H5Pget_virtual_count(settings.id(), &raw mut count) });
    let name = |read: unsafe extern "C" fn(i64, usize, *mut c_char, usize) -> isize, index| {
        let mut text = vec![0_u8; LONGEST_VALUE];
        // SAFETY: as above; the buffer is as long as said.
        let length = sync(|| unsafe { read(settings.id(), index, text.as_mut_ptr().cast(), LONGEST_VALUE) });
        text.truncate(usize::try_from(length).ok().filter(|length| *length < LONGEST_VALUE)?);
        String::from_utf8(text).ok()
    };
    let source = |index| Some((name(H5Pget_virtual_filename, index)?, name(H5Pget_virtual_dsetname, index)?));
    (status >= 0).then(|| (0..count).map(source).collect())?
}

/// Numbers of one field of the records of a dataset of one dimension, as f64; `None` where they cannot be read.
pub(crate) fn read_field(dataset: &Dataset, field: &str, range: Range<usize>) -> Option<Vec<f64>> {
    let name = CString::new(field).ok()?;
    let (start, count) = ([range.start as hsize_t], [range.len() as hsize_t]);
    let mut values = vec![0_f64; range.len()];
    let space = dataset.space().ok()?;
    // SAFETY: all identifiers are made here or live in the dataset and its space; the type in memory has one number of eight bytes a
    // record, and the buffer as many numbers as are selected. Everything is done under the library's lock, and closed before it ends.
    let status = sync(|| unsafe {
        let record = H5Tcreate(H5T_class_t::H5T_COMPOUND, size_of::<f64>());
        let memory = H5Screate_simple(1, count.as_ptr(), std::ptr::null());
        let mut status = H5Tinsert(record, name.as_ptr(), 0, *H5T_NATIVE_DOUBLE);
        if status >= 0 {
            let chosen = H5S_seloper_t::H5S_SELECT_SET;
            status = H5Sselect_hyperslab(
                space.id(),
                chosen,
                start.as_ptr(),
                std::ptr::null(),
                count.as_ptr(),
                std::ptr::null(),
            );
        }
        if status >= 0 {
            status = H5Dread(dataset.id(), record, memory, space.id(), H5P_DEFAULT, values.as_mut_ptr().cast());
        }
        H5Sclose(memory);
        H5Tclose(record);
        status
    });
    (status >= 0).then_some(values)
}

/// The longest length that the references of an attribute or a dataset to texts of variable length state, in bytes; `None` where they cannot be read.
///
/// To read the texts, the library takes memory of that length, and clears it, before it examines the texts.
pub(crate) fn longest_text(container: &Container) -> Option<u32> {
    static ONCE: Once = Once::new();
    let source = Datatype::from_type::<VarLenUnicode>().ok()?;
    let mut references = vec![0_u8; container.size().checked_mul(REFERENCE)?];
    // SAFETY: the types are made here or live as long as `source`; the buffer has as many elements of the type in memory as the container. The
    // conversion that is registered leaves the bytes as the file holds them, and agrees to nothing but elements of this size. Everything is done under the
    // library's lock, and closed before it ends.
    let status = sync(|| unsafe {
        let memory = H5Tcreate(H5T_class_t::H5T_OPAQUE, REFERENCE);
        ONCE.call_once(|| {
            let soft = H5T_pers_t::H5T_PERS_SOFT;
            H5Tregister(soft, c"references".as_ptr(), source.id(), memory, Some(as_stored));
        });
        let to = references.as_mut_ptr().cast();
        let status = match H5Iget_type(container.id()) {
            H5I_type_t::H5I_ATTR => H5Aread(container.id(), memory, to),
            _ => H5Dread(container.id(), memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, to),
        };
        H5Tclose(memory);
        status
    });
    let length = |reference: &[u8]| reference.first_chunk().map(|length| u32::from_le_bytes(*length));
    (status >= 0).then(|| references.chunks_exact(REFERENCE).filter_map(length).max().unwrap_or(0))
}

/// A conversion that leaves references as the file holds them (HDF5 reference, H5Tregister).
extern "C" fn as_stored(
    source: hid_t,
    target: hid_t,
    data: *mut H5T_cdata_t,
    _count: usize,
    _stride: usize,
    _other_stride: usize,
    _elements: *mut c_void,
    _others: *mut c_void,
    _settings: hid_t,
) -> c_int {
    // SAFETY: the library calls it with its lock taken, with types that live, and with a record that is its own.
    unsafe {
        if (*data).command == H5T_cmd_t::H5T_CONV_INIT {
            (*data).need_bkg = H5T_bkg_t::H5T_BKG_NO;
            return if H5Tget_size(source) == REFERENCE && H5Tget_size(target) == REFERENCE { 0 } else { -1 };
        }
    }
    0
}
