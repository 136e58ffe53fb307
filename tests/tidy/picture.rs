//! The rooms of the crates and what they import of each other, as a picture.

use std::collections::BTreeSet;
use std::fmt::Write;

/// One crate: its rooms from top to bottom, and which imports which.
pub(crate) struct Column {
    pub(crate) title: String,
    pub(crate) rooms: Vec<String>,
    pub(crate) edges: BTreeSet<(usize, usize)>,
}

/// Width of a column, its names and its arcs [px].
const WIDTH: f64 = 430.0;
/// Where the arcs of a column begin [px].
const NAMES: f64 = 190.0;
/// Height of a line [px].
const LINE: f64 = 22.0;
/// Height of the titles [px].
const TITLE: f64 = 40.0;

/// An SVG with a column for each crate: an arc leads from a room up to one that it imports, the wider the farther.
pub(crate) fn draw(columns: &[Column]) -> String {
    let lines = columns
        .iter()
        .map(|column| column.rooms.len())
        .max()
        .unwrap_or(0);
    let (width, height) = (
        WIDTH * columns.len() as f64,
        TITLE + LINE * (lines as f64 + 1.0),
    );
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" \
         font-size=\"13\">\n<title>Rooms of the crates; arcs lead from a room to those that it imports</title>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    for (n, column) in columns.iter().enumerate() {
        let left = 12.0 + WIDTH * n as f64;
        let height_of = |room: usize| TITLE + LINE * (room as f64 + 0.5);
        writeln!(
            svg,
            "<text x=\"{left}\" y=\"22\" font-weight=\"bold\">{}</text>",
            column.title
        )
        .expect("a text");
        for &(from, to) in &column.edges {
            let (x, below, above) = (left + NAMES, height_of(from) - 4.0, height_of(to) - 4.0);
            let reach = x
                + 14.0
                + (WIDTH - NAMES - 40.0) * (below - above).abs() / (LINE * lines as f64) * 1.3;
            writeln!(
                svg,
                "<path d=\"M{x} {below} C{reach:.0} {below} {reach:.0} {above} {x} {above}\" fill=\"none\" \
                 stroke=\"{}\" stroke-width=\"1\" opacity=\"0.6\"/>",
                COLOURS[to % COLOURS.len()]
            )
            .expect("a text");
        }
        for (room, name) in column.rooms.iter().enumerate() {
            let colour = COLOURS[room % COLOURS.len()];
            let y = height_of(room);
            writeln!(
                svg,
                "<text x=\"{left}\" y=\"{y}\">{name}</text><circle cx=\"{}\" cy=\"{}\" r=\"3\" fill=\"{colour}\"/>",
                left + NAMES,
                y - 4.0
            )
            .expect("a text");
        }
    }
    svg + "</svg>\n"
}

/// Colours of the imported rooms, in turn.
const COLOURS: [&str; 6] = [
    "#1b6ca8", "#c8553d", "#3a7d44", "#7d5ba6", "#b8860b", "#4a4a4a",
];
