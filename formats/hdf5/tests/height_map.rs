//! Height maps: written and read, with holes, and what is wrong with them by name.

use hdf5_metno::File;
use runout_core::{height_grid::HeightGrid, points::Points};
use runout_hdf5::{read_height_map, write_height_map};

fn grid() -> HeightGrid {
    let mut height_nm: Vec<f64> = (0..12).map(f64::from).collect();
    height_nm[5] = f64::NAN;
    HeightGrid {
        columns: 4,
        step_x_mm: 0.01,
        step_y_mm: 0.02,
        origin_x_mm: -1.0,
        origin_y_mm: 3.0,
        std_nm: Some(0.1),
        height_nm,
    }
}

/// Writes a good map, changes it, and gives what reading it says.
fn after(change: impl Fn(&File)) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.h5");
    write_height_map(&grid(), &path, "a map", None).unwrap();
    let file = File::open_rw(&path).unwrap();
    change(&file);
    file.close().unwrap();
    match read_height_map(&path) {
        Ok(grid) => format!("read: {} rows, {} holes", grid.rows(), grid.holes()),
        Err(error) => format!("{error}; {}", error.advice().unwrap_or_default()),
    }
}

fn put(file: &File, name: &str, value: f64) {
    file.delete_attr(name).unwrap();
    file.new_attr::<f64>().create(name).unwrap().write_scalar(&value).unwrap();
}

fn heights(file: &File, shape: &[usize], value: f64) {
    file.unlink("height_nm").unwrap();
    let count = shape.iter().product();
    let data = ndarray::ArrayD::from_shape_vec(shape, vec![value; count]).unwrap();
    file.new_dataset_builder().with_data(&data).create("height_nm").unwrap();
}

#[test]
fn a_map_is_read_as_it_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.h5");
    write_height_map(&grid(), &path, "a map", Some("truth")).unwrap();
    let read = read_height_map(&path).unwrap();
    assert!(read.height_nm[5].is_nan());
    assert_eq!(format!("{read:?}"), format!("{:?}", grid()));
    let points = Points::of_grid(read, path);
    assert_eq!(points.column("x_mm").unwrap().len(), 11);
    assert!((points.column("height_nm").unwrap()[5] - 6.0).abs() < 1e-12);
    let place = ["x_mm", "y_mm"].map(|name| points.column(name).unwrap()[5]);
    assert!((place[0] + 0.98).abs() < 1e-12 && (place[1] - 3.02).abs() < 1e-12, "{place:?}");
}

#[test]
fn what_is_wrong_is_named() {
    #[allow(clippy::type_complexity, reason = "a table of cases")]
    let cases: [(&dyn Fn(&File), &[&str]); 11] = [
        (&|_| {}, &["read: 3 rows, 1 holes"]),
        (&|file| file.delete_attr("format").unwrap(), &["map.h5:/", "`format` is missing", "another program"]),
        (&|file| put(file, "version", 2.0), &["expected version 1", "found 2"]),
        (&|file| put(file, "step_x_mm", 0.0), &["`step_x_mm`", "above 0", "found 0"]),
        (&|file| put(file, "step_y_mm", f64::NAN), &["`step_y_mm`", "finite number"]),
        (&|file| file.delete_attr("origin_y_mm").unwrap(), &["`origin_y_mm`"]),
        (&|file| put(file, "std_nm", -1.0), &["`std_nm`", "above 0"]),
        (&|file| file.unlink("height_nm").unwrap(), &["/height_nm", "found nothing of that name"]),
        (&|file| heights(file, &[1, 20], 0.0), &["two or more rows", "1 by 20"]),
        (&|file| heights(file, &[20], 0.0), &["[rows, columns]", "[20]"]),
        (&|file| heights(file, &[4, 4], f64::NAN), &["0 of 16 points have a height"]),
    ];
    for (change, parts) in cases {
        let found = after(change);
        for part in parts {
            assert!(found.contains(part), "`{part}` is not in: {found}");
        }
    }
    assert!(after(|file| heights(file, &[4, 4], f64::INFINITY)).contains("row 0, column 0 is infinite"));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("text.h5");
    std::fs::write(&path, "no HDF5").unwrap();
    assert!(read_height_map(&path).unwrap_err().to_string().contains("no HDF5 file"));
}
