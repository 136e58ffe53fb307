//! Labels in YOLO form: `labels/NAME.txt` beside `images/NAME.png`, and `data.yaml`.

use super::row::Objects;
use std::fmt::Write;
use wake_physics::labels::Class;

/// The lines `class x y width height`, centre and size as shares of the image; empty without objects.
pub(super) fn yolo(objects: &Objects, [rows, columns]: [usize; 2]) -> String {
    let (height, width) = (rows as f64, columns as f64);
    let mut text = String::new();
    for (class, [x, y, w, h]) in objects.categories.iter().zip(&objects.bbox) {
        let (centre_x, centre_y) = ((x + 0.5 * w) / width, (y + 0.5 * h) / height);
        let (w, h) = (w / width, h / height);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{class} {centre_x:.6} {centre_y:.6} {w:.6} {h:.6}");
    }
    text
}

/// The content of `data.yaml`.
pub(super) fn data_yaml() -> String {
    let names: String = [Class::Wake, Class::Ship]
        .map(|class| format!("  {}: {}\n", class.number(), class.name()))
        .concat();
    format!(
        "# For validation name another set, made with another seed.\ntrain: images\nval: images\nnames:\n{names}"
    )
}
