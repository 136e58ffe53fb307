use super::*;
use crate::kelvin::{KELVIN_ANGLE, KelvinWake};
use std::f64::consts::PI;

/// 201 × 201 pixels of 10 m: centres from −1000 m to +1000 m both ways.
fn square() -> Raster {
    Raster::image(201, 201, 10.0)
}

fn ship(heading: f64, position: [f64; 2]) -> Ship {
    Ship {
        position,
        heading,
        speed: 10.0,
        length: 200.0,
        beam: 30.0,
        echo: true,
        ..Ship::default()
    }
}

/// Waves visible as far as any image reaches, and no dark line.
const ALL_WAVES: Extent = Extent {
    waves: 1e9,
    ..Extent::NOTHING
};

/// The labels of a ship in deep water.
fn labelled(ship: &Ship, displacement: f64, extent: &Extent, raster: &Raster) -> LabelledShip {
    let frame = Frame::new(ship.position, ship.heading, raster);
    LabelledShip {
        ship: frame.ship(ship, displacement),
        wake: frame.wake(ship, KELVIN_ANGLE, extent),
    }
}

/// The two ends of a straight line.
fn ends(line: &[Pixel]) -> [Pixel; 2] {
    line.try_into().unwrap()
}

fn close(a: Pixel, b: Pixel) -> bool {
    (a[0] - b[0]).abs() < 1e-9 && (a[1] - b[1]).abs() < 1e-9
}

/// Ship in the middle, toward 0°: apex 100 m ahead (row 90); the arms reach the lower edge 1100 m behind it,
/// 1100·tan 19.47° = 1100/√8 m aside.
#[test]
fn northward_by_hand() {
    let labels = labelled(&ship(0.0, [0.0, 0.0]), 0.0, &ALL_WAVES, &square());
    let aside = 110.0 / 8f64.sqrt();
    let wake = &labels.wake;
    assert!(close(wake.tip_px.unwrap(), [100.0, 90.0]));
    assert!(close(wake.arms_px[0][0], [100.0, 90.0]) && close(wake.arms_px[1][0], [100.0, 90.0]));
    // Port is to the left of a ship that moves up.
    assert!(close(wake.arms_px[0][1], [100.0 - aside, 200.0]));
    assert!(close(wake.arms_px[1][1], [100.0 + aside, 200.0]));
    let [from, to] = ends(&wake.centreline_px);
    assert!(close(from, [100.0, 110.0]) && close(to, [100.0, 200.0]));
    let [x, y, width, height] = wake.box_px.unwrap();
    assert!(close([x, y], [100.0 - aside, 90.0]) && close([width, height], [2.0 * aside, 110.0]));
    let corners = wake.oriented_box_px.unwrap();
    assert!(close(corners[0], [100.0 - aside, 90.0]) && close(corners[2], [100.0 + aside, 200.0]));
    assert!((wake.length_px - 110.0).abs() < 1e-9);
    assert_eq!(
        (wake.axis_deg, wake.half_angle_deg),
        (Some(180.0), Some(KELVIN_ANGLE.to_degrees()))
    );
    assert!(close(labels.ship.position_px.unwrap(), [100.0, 100.0]));
}

/// Eight headings: the pixel geometry turns with the heading, clockwise on the screen.
#[test]
fn eight_headings() {
    for i in 0..8 {
        let heading = 45.0 * f64::from(i);
        let labels = labelled(&ship(heading, [0.0, 0.0]), 0.0, &ALL_WAVES, &square());
        // On the screen, up is row 0: heading h moves (sin h, −cos h) in (column, row).
        let (sin, cos) = heading.to_radians().sin_cos();
        let wake = &labels.wake;
        assert!(close(
            wake.tip_px.unwrap(),
            [100.0 + 10.0 * sin, 100.0 - 10.0 * cos]
        ));
        let [from, to] = ends(&wake.centreline_px);
        assert!(close(from, [100.0 - 10.0 * sin, 100.0 + 10.0 * cos]));
        for (arm, side) in wake.arms_px.iter().zip([1.0, -1.0]) {
            // Port lies clockwise of astern, starboard counter-clockwise.
            let bearing = wake.axis_deg.unwrap().to_radians() + side * KELVIN_ANGLE;
            let [dx, dy] = [arm[1][0] - arm[0][0], arm[1][1] - arm[0][1]];
            let length = dx.hypot(dy);
            assert!(close(
                [dx / length, dy / length],
                [bearing.sin(), -bearing.cos()]
            ));
            assert!(on_edge(arm[1]), "{heading} {arm:?}");
        }
        assert!(on_edge(to));
        assert_eq!(wake.arms_px.len(), 2);
        everything_lies_in_the_boxes(&labels, heading);
    }
}

fn on_edge(p: Pixel) -> bool {
    p.iter().any(|v| v.abs() < 1e-9 || (v - 200.0).abs() < 1e-9)
}

/// Both boxes hold arms and centreline and touch the image's edge or an arm on every side.
fn everything_lies_in_the_boxes(labels: &LabelledShip, heading: f64) {
    let wake = &labels.wake;
    let ends: Vec<Pixel> = wake.arms_px.iter().flatten().copied().collect();
    let [x, y, width, height] = wake.box_px.unwrap();
    assert!(x >= 0.0 && y >= 0.0 && x + width <= 200.0 + 1e-9 && y + height <= 200.0 + 1e-9);
    let (sin, cos) = heading.to_radians().sin_cos();
    let corners = wake.oriented_box_px.unwrap();
    for p in ends {
        assert!(p[0] >= x - 1e-9 && p[0] <= x + width + 1e-9);
        assert!(p[1] >= y - 1e-9 && p[1] <= y + height + 1e-9);
        let along = |q: Pixel| q[0] * sin - q[1] * cos;
        let across = |q: Pixel| q[0] * cos + q[1] * sin;
        assert!(along(p) <= along(corners[0]) + 1e-9 && along(p) >= along(corners[2]) - 1e-9);
        assert!(across(p) >= across(corners[0]) - 1e-9 && across(p) <= across(corners[2]) + 1e-9);
    }
    // Right angles, and the first side across the track.
    let side = |a: usize, b: usize| [corners[b][0] - corners[a][0], corners[b][1] - corners[a][1]];
    let (first, second) = (side(0, 1), side(1, 2));
    assert!((first[0] * second[0] + first[1] * second[1]).abs() < 1e-6);
    assert!((first[0] * sin - first[1] * cos).abs() < 1e-9);
}

/// The box of the wedge agrees with a search over all pixels.
#[test]
fn boxes_hold_every_pixel_of_the_wedge() {
    let raster = Raster::image(90, 140, 10.0);
    for i in 0..24 {
        let heading = 15.0 * f64::from(i) + 3.0;
        let ship = ship(heading, [150.0, -220.0]);
        let wake = labelled(&ship, 0.0, &ALL_WAVES, &raster).wake;
        let (sin, cos) = heading.to_radians().sin_cos();
        let apex = [150.0 + 100.0 * sin, -220.0 + 100.0 * cos];
        let (mut low, mut high, mut any) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2], false);
        for row in 0..raster.rows {
            for column in 0..raster.columns {
                let [x, y] = [raster.x(column) - apex[0], raster.y(row) - apex[1]];
                let (astern, aside) = (-(x * sin + y * cos), (x * cos - y * sin).abs());
                if aside <= astern * KELVIN_ANGLE.tan() {
                    any = true;
                    for (a, v) in [column as f64, row as f64].into_iter().enumerate() {
                        low[a] = low[a].min(v);
                        high[a] = high[a].max(v);
                    }
                }
            }
        }
        assert!(any);
        let [x, y, width, height] = wake.box_px.unwrap();
        // The box bounds the continuous wedge: it holds all pixels, and near the apex some more.
        assert!(x <= low[0] + 1e-9 && y <= low[1] + 1e-9);
        assert!(x + width >= high[0] - 1e-9 && y + height >= high[1] - 1e-9);
        assert!(low[0] - x < 3.0 && low[1] - y < 3.0);
        assert!(x + width - high[0] < 3.0 && y + height - high[1] < 3.0);
    }
}

#[test]
fn an_approaching_ship_is_seen_further_along_the_flight() {
    let east = ship(90.0, [0.0, 0.0]);
    for (displacement, row) in [(400.0, 60.0), (-400.0, 140.0)] {
        let labels = labelled(&east, displacement, &ALL_WAVES, &square());
        assert!(close(labels.ship.position_px.unwrap(), [100.0, 100.0]));
        assert!(close(labels.ship.echo_px.unwrap(), [100.0, row]));
        let [x, y, width, height] = labels.ship.echo_box_px.unwrap();
        assert!(close([x, y], [90.0, row - 1.5]) && close([width, height], [20.0, 3.0]));
        // The wake stays at its place.
        assert!(close(labels.wake.tip_px.unwrap(), [110.0, 100.0]));
    }
    let gone = labelled(&ship(270.0, [0.0, 0.0]), 1e5, &ALL_WAVES, &square()).ship;
    assert!(gone.echo_px.is_none() && gone.echo_box_px.is_none() && gone.position_px.is_some());
    // An echo that is not drawn has no box.
    let silent = Ship {
        echo: false,
        ..east
    };
    let labels = labelled(&silent, 0.0, &ALL_WAVES, &square());
    assert!(labels.ship.echo_px.is_some() && labels.ship.echo_box_px.is_none());
}

#[test]
fn a_ship_outside_may_leave_its_wake_inside() {
    let away = labelled(&ship(0.0, [200.0, 5000.0]), 0.0, &ALL_WAVES, &square());
    assert!(away.ship.position_px.is_none() && away.wake.tip_px.is_none());
    assert!(close(away.ship.position_m, [200.0, 5000.0]));
    let [from, to] = ends(&away.wake.centreline_px);
    assert!(close(from, [120.0, 0.0]) && close(to, [120.0, 200.0]));
    // 4100 m behind the bow the arms are 1450 m aside: outside; the wedge is the whole image.
    assert!(away.wake.arms_px.is_empty());
    let [x, y, width, height] = away.wake.box_px.unwrap();
    assert!(close([x, y], [0.0, 0.0]) && close([width, height], [200.0, 200.0]));
    // From the bow at 5100 m to the lower edge at −1000 m.
    assert!((away.wake.length_px - 610.0).abs() < 1e-9);
    // Waves that end 4 km astern of the bow end before the image begins.
    let faded = Extent {
        waves: 4000.0,
        ..Extent::NOTHING
    };
    let faded = labelled(&ship(0.0, [200.0, 5000.0]), 0.0, &faded, &square()).wake;
    assert_eq!(
        (faded.box_px, faded.centreline_px, faded.length_px),
        (None, Vec::new(), 0.0)
    );
    // With the opposite heading, the wake lies away from the image.
    let ahead = labelled(&ship(180.0, [200.0, 5000.0]), 0.0, &ALL_WAVES, &square());
    assert_eq!((ahead.wake.box_px, ahead.wake.length_px), (None, 0.0));
    assert!(ahead.wake.arms_px.is_empty() && ahead.wake.centreline_px.is_empty());
}

/// Waves visible up to 600 m astern of the bow at row 90 end in row 150; the dark line, 20 m to either side, ends in row 180. If
/// only the line is visible, the box holds it alone.
#[test]
fn boxes_end_where_the_wake_does() {
    let both = Extent {
        waves: 600.0,
        dark_line: 900.0,
        half_width: 20.0,
        visibility: None,
    };
    let wake = labelled(&ship(0.0, [0.0, 0.0]), 0.0, &both, &square()).wake;
    let aside = 60.0 / 8f64.sqrt();
    for (arm, side) in wake.arms_px.iter().zip([-1.0, 1.0]) {
        assert!(close(arm[1], [100.0 + side * aside, 150.0]), "{arm:?}");
    }
    assert!(close(wake.centreline_px[1], [100.0, 180.0]));
    let [x, y, width, height] = wake.box_px.unwrap();
    assert!(close([x, y], [100.0 - aside, 90.0]) && close([width, height], [2.0 * aside, 90.0]));
    assert!(close(
        wake.oriented_box_px.unwrap()[2],
        [100.0 + aside, 180.0]
    ));
    assert!((wake.length_px - 90.0).abs() < 1e-9);
    let line = Extent { waves: 0.0, ..both };
    let wake = labelled(&ship(0.0, [0.0, 0.0]), 0.0, &line, &square()).wake;
    assert!(wake.arms_px.is_empty());
    let [x, y, width, height] = wake.box_px.unwrap();
    assert!(close([x, y], [98.0, 90.0]) && close([width, height], [4.0, 90.0]));
}

#[test]
fn nothing_is_labelled_where_nothing_is() {
    let mut scene = Scene::default();
    (scene.grid.rows, scene.grid.columns) = (64, 64);
    let at_rest = labels_of(&scene.with_assignments(&["ship.speed=0"]).unwrap());
    assert_eq!(at_rest.ships.len(), 1);
    assert_eq!(at_rest.ships[0].wake, WakeLabel::default());
    assert!(at_rest.ships[0].ship.echo_px.is_some() && at_rest.objects().is_empty());
    // An image of one pixel has no extent.
    let one = labelled(
        &ship(30.0, [0.0, 0.0]),
        0.0,
        &ALL_WAVES,
        &Raster::image(1, 1, 10.0),
    );
    assert_eq!((one.wake.box_px, one.ship.echo_box_px), (None, None));
    scene.ships.clear();
    assert_eq!(labels_of(&scene).ships, []);
}

/// Objects are the labels of visible wakes and drawn echoes.
#[test]
fn objects_are_the_visible_wakes_and_the_drawn_ships() {
    let extent = Extent {
        visibility: Some(Visibility {
            contrast_db: 1.0,
            snr: 0.5,
        }),
        ..ALL_WAVES
    };
    let one = labelled(&ship(45.0, [0.0, 0.0]), 300.0, &extent, &square());
    let labels = Labels {
        ships: vec![one.clone(), one],
        ..Labels::default()
    };
    let objects = labels.objects();
    assert_eq!(objects.len(), 4);
    let (wake, ship) = (objects[2], objects[3]);
    assert_eq!((wake.class, ship.class), (Class::Wake, Class::Ship));
    assert_eq!((wake.axis_deg, ship.axis_deg), (225.0, 225.0));
    assert_eq!(wake.visibility, extent.visibility);
    assert!((wake.half_angle_deg - KELVIN_ANGLE.to_degrees()).abs() < 1e-12);
    assert!((ship.length_px - 20.0).abs() < 1e-9 && ship.half_angle_deg == 0.0);
    // The bow of the echo: 100 m ahead of midship, which is displaced by 30 rows.
    let bow = 10.0 * 0.5f64.sqrt();
    assert!(close(ship.tip.unwrap(), [100.0 + bow, 70.0 - bow]));
    // Corners run around the hull: 30 m, then 200 m.
    let side = |a: usize, b: usize| {
        let [p, q] = [ship.oriented_box_px[a], ship.oriented_box_px[b]];
        (p[0] - q[0]).hypot(p[1] - q[1])
    };
    assert!((side(0, 1) - 3.0).abs() < 1e-9 && (side(1, 2) - 20.0).abs() < 1e-9);
    let empty = Labels {
        ships: vec![LabelledShip::default()],
        ..Labels::default()
    };
    assert!(empty.objects().is_empty());
}

#[test]
fn json_has_the_stated_keys_and_empty_lists() {
    let mut scene = Scene::default()
        .with_assignments(&["ship.echo=true"])
        .unwrap();
    (scene.grid.rows, scene.grid.columns) = (128, 128);
    let full = labels_of(&scene);
    let value = serde_json::to_value(&full).unwrap();
    let keys = |value: &serde_json::Value| {
        let mut keys: Vec<String> = value.as_object().unwrap().keys().cloned().collect();
        keys.sort();
        keys.join(" ")
    };
    let one = &value["ships"][0];
    assert_eq!(keys(&value), "sea_displacement_m ships");
    assert_eq!(keys(one), "ship wake");
    assert_eq!(
        keys(&one["ship"]),
        "azimuth_displacement_m echo_box_px echo_oriented_box_px echo_px heading length position_m position_px speed"
    );
    assert_eq!(
        keys(&one["wake"]),
        "arms_px axis_deg box_px centreline_px half_angle_deg length_px oriented_box_px tip_px visibility"
    );
    assert_eq!(keys(&one["wake"]["visibility"]), "contrast_db snr");
    for (key, length) in [
        ("tip_px", 2),
        ("arms_px", 2),
        ("centreline_px", 2),
        ("box_px", 4),
    ] {
        assert_eq!(one["wake"][key].as_array().unwrap().len(), length, "{key}");
    }
    let nothing = serde_json::to_value(LabelledShip::default()).unwrap();
    for key in [
        "tip_px",
        "arms_px",
        "centreline_px",
        "box_px",
        "oriented_box_px",
    ] {
        assert_eq!(nothing["wake"][key], serde_json::json!([]), "{key}");
    }
    assert_eq!(nothing["ship"]["echo_px"], serde_json::json!([]));
    assert!(nothing["wake"]["visibility"].is_null() && nothing["wake"]["axis_deg"].is_null());
    let empty = Labels {
        ships: vec![LabelledShip::default()],
        ..Labels::default()
    };
    for labels in [full, empty, Labels::default()] {
        // Through a value, not a text: serde_json reads floats to the last bit only on demand.
        let value = serde_json::to_value(&labels).unwrap();
        assert_eq!(serde_json::from_value::<Labels>(value).unwrap(), labels);
    }
}

/// A ship of heading 0 in the middle that turns to starboard with a given curvature, as in `track::tests`.
fn turned(extent: &Extent, curvature: f64) -> WakeLabel {
    let wake = KelvinWake {
        hull: crate::hull::Hull::wigley(200.0, 30.0, 10.0),
        speed: 10.0,
        track: crate::track::Track::turning([0.0; 2], 0.0, 0.0, curvature),
        depth: f64::INFINITY,
        filter_depth: 0.0,
        steepness: None,
    };
    Frame::new([0.0; 2], 0.0, &square()).curved_wake(&wake, KELVIN_ANGLE, extent)
}

/// A half circle of dark line, 20 m to each side, has a box around it and a line along it.
#[test]
fn a_dark_line_on_a_turn_by_hand() {
    let half_circle = Extent {
        dark_line: 100.0 + 500.0 * PI,
        half_width: 20.0,
        ..Extent::NOTHING
    };
    let wake = turned(&half_circle, 1.0 / 500.0);
    let [x, y, width, height] = wake.box_px.unwrap();
    // A chord of a 24th of the half circle and the bow's 100 m stays R (1 − cos(0.07)) = 1.3 m, 0.13 pixels, inside. From 2
    // pixels west of the ship to the eastern edge, 100 pixels east of it; 52 pixels to the south.
    assert!(
        (x - 98.0).abs() < 0.6 && (x + width - 200.0).abs() < 1e-9,
        "{x} {width}"
    );
    assert!((y + height - 152.0).abs() < 0.15, "{y} {height}");
    assert_eq!(
        (wake.axis_deg, wake.tip_px),
        (Some(180.0), Some([100.0, 90.0]))
    );
    // The line begins at the stern and ends where it leaves the image.
    let line = &wake.centreline_px;
    assert!(line.len() > 20);
    for [column, row] in line {
        let radius = (column - 150.0).hypot(row - 100.0);
        assert!((radius - 50.0).abs() < 0.15, "{column} {row}");
    }
    assert!((wake.length_px - 0.1 * half_circle.dark_line).abs() < 1e-9);
}

/// The arms on a turn follow the rays of their waves from where they were sent, computed by hand for two of them.
#[test]
fn arms_on_a_turn_are_where_their_waves_have_come_to() {
    let extent = Extent {
        waves: 500.0,
        ..Extent::NOTHING
    };
    let wake = turned(&extent, 1.0 / 500.0);
    // The last place was sent 750 m before the bow: 650 m of arc before midship, 1.3 rad. From there a third of 750 m
    // forward and √2/6 of it aside; forward is (sin −1.3, cos −1.3).
    let (sin, cos) = 1.3f64.sin_cos();
    let sent = [500.0 * (1.0 - cos), -500.0 * sin];
    let (forward, aside) = (250.0, 750.0 * 2f64.sqrt() / 6.0);
    for (arm, side) in wake.arms_px.iter().zip([1.0, -1.0]) {
        let x = sent[0] - forward * sin - side * aside * cos;
        let y = sent[1] + forward * cos - side * aside * sin;
        let last = arm.last().unwrap();
        // The steepest of 512 rays is within 1e-5 of the cusp's angle, its place along the arm within the square root of that.
        assert!(
            (last[0] - 100.0 - 0.1 * x).abs() < 0.3 && (last[1] - 100.0 + 0.1 * y).abs() < 0.3,
            "{last:?} {x} {y}"
        );
    }
    assert_eq!(wake.arms_px.len(), 2);
}

/// On a wide turn, the label equals that of a straight track.
#[test]
fn a_wide_turn_has_the_label_of_a_straight_track() {
    let extent = Extent {
        waves: 700.0,
        dark_line: 900.0,
        half_width: 30.0,
        visibility: None,
    };
    let straight = labelled(&ship(0.0, [0.0, 0.0]), 0.0, &extent, &square()).wake;
    let wide = turned(&extent, 1e-7);
    // 1050² m²/2R = 0.055 m at 10,000 km, less for nearer places; arms as above.
    let pairs = [(wide.box_px, straight.box_px)];
    for (a, b) in pairs {
        for (a, b) in a.unwrap().into_iter().zip(b.unwrap()) {
            assert!((a - b).abs() < 0.3, "{a} {b}");
        }
    }
    for (a, b) in wide.arms_px.iter().zip(&straight.arms_px) {
        let [a, b] = [a, b].map(|arm| *arm.last().unwrap());
        assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 0.3, "{a:?} {b:?}");
    }
    assert!((wide.length_px - straight.length_px).abs() < 0.1);
}

/// A column of pixels is one pixel wide: what crosses it has a length, and a box of that width.
#[test]
fn one_column_and_one_row_have_boxes() {
    let extent = Extent {
        waves: 600.0,
        dark_line: 900.0,
        half_width: 30.0,
        visibility: None,
    };
    for (heading, rows, columns) in [(0.0, 201, 1), (90.0, 1, 201)] {
        let raster = Raster::image(rows, columns, 10.0);
        let wake = labelled(&ship(heading, [0.0, 0.0]), 0.0, &extent, &raster).wake;
        let [x, y, width, height] = wake.box_px.unwrap();
        let [along, across] = if columns == 1 {
            [[y, height], [x, width]]
        } else {
            [[x, width], [y, height]]
        };
        // From the bow at 100 m to 900 m astern of it, on rows counted down and columns to the right.
        let first = if columns == 1 { 90.0 } else { 20.0 };
        assert!(close(along, [first, 90.0]), "{along:?}");
        assert!(close(across, [-0.5, 1.0]), "{across:?}");
        assert!((wake.length_px - 90.0).abs() < 1e-9);
        let [from, to] = ends(&wake.centreline_px);
        assert!((from[0] - to[0]).abs() + (from[1] - to[1]).abs() > 60.0);
        // A track that crosses it leaves a line and a box, or neither.
        let across = labelled(&ship(heading + 60.0, [0.0, 0.0]), 0.0, &extent, &raster).wake;
        assert!(across.box_px.is_some());
    }
}
