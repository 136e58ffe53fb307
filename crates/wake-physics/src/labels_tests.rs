use super::*;

/// 201 × 201 pixels of 10 m: centres from −1000 m to +1000 m both ways.
fn square() -> Raster {
    Raster::image(201, 201, 10.0)
}

fn track(heading: f64, position: [f64; 2]) -> Track {
    Track {
        position,
        heading,
        speed: 10.0,
        length: 200.0,
        beam: 30.0,
        azimuth_displacement: 0.0,
    }
}

fn close(a: Pixel, b: Pixel) -> bool {
    (a[0] - b[0]).abs() < 1e-9 && (a[1] - b[1]).abs() < 1e-9
}

#[test]
fn kelvin_angle_is_its_sine() {
    assert!((KELVIN_ANGLE.sin() - 1.0 / 3.0).abs() < 1e-16);
    assert!((KELVIN_ANGLE.to_degrees() - 19.4712).abs() < 1e-4);
}

/// Ship in the middle, toward 0°: apex 100 m ahead (row 90); the arms reach the lower edge 1100 m behind it,
/// 1100·tan 19.47° = 1100/√8 m aside.
#[test]
fn northward_by_hand() {
    let labels = Labels::new(Some(&track(0.0, [0.0, 0.0])), &square());
    let aside = 110.0 / 8f64.sqrt();
    let wake = &labels.wake;
    assert!(close(wake.apex_px.unwrap(), [100.0, 90.0]));
    assert!(close(wake.arms_px[0][0], [100.0, 90.0]) && close(wake.arms_px[1][0], [100.0, 90.0]));
    // Port is to the left of a ship that moves up.
    assert!(close(wake.arms_px[0][1], [100.0 - aside, 200.0]));
    assert!(close(wake.arms_px[1][1], [100.0 + aside, 200.0]));
    let [from, to] = wake.centreline_px.unwrap();
    assert!(close(from, [100.0, 110.0]) && close(to, [100.0, 200.0]));
    let [x, y, width, height] = wake.box_px.unwrap();
    assert!(close([x, y], [100.0 - aside, 90.0]) && close([width, height], [2.0 * aside, 110.0]));
    let corners = wake.oriented_box_px.unwrap();
    assert!(close(corners[0], [100.0 - aside, 90.0]) && close(corners[2], [100.0 + aside, 200.0]));
    assert!(close(labels.ship.position_px.unwrap(), [100.0, 100.0]));
}

/// Eight headings: the pixel geometry turns with the heading, clockwise on the screen.
#[test]
fn eight_headings() {
    for i in 0..8 {
        let heading = 45.0 * f64::from(i);
        let labels = Labels::new(Some(&track(heading, [0.0, 0.0])), &square());
        // On the screen, up is row 0: heading h moves (sin h, −cos h) in (column, row).
        let (sin, cos) = heading.to_radians().sin_cos();
        let wake = &labels.wake;
        assert!(close(
            wake.apex_px.unwrap(),
            [100.0 + 10.0 * sin, 100.0 - 10.0 * cos]
        ));
        let [from, to] = wake.centreline_px.unwrap();
        assert!(close(from, [100.0 - 10.0 * sin, 100.0 + 10.0 * cos]));
        for (arm, side) in wake.arms_px.iter().zip([1.0, -1.0]) {
            // Port lies clockwise of astern, starboard counter-clockwise.
            let bearing = (heading + 180.0).to_radians() + side * KELVIN_ANGLE;
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
fn everything_lies_in_the_boxes(labels: &Labels, heading: f64) {
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

/// The box of the wedge, against a search over all pixels.
#[test]
fn boxes_hold_every_pixel_of_the_wedge() {
    let raster = Raster::image(90, 140, 10.0);
    for i in 0..24 {
        let heading = 15.0 * f64::from(i) + 3.0;
        let ship = track(heading, [150.0, -220.0]);
        let wake = Labels::new(Some(&ship), &raster).wake;
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
        // The box is that of the continuous wedge: it holds all pixels, and near the apex some more.
        assert!(x <= low[0] + 1e-9 && y <= low[1] + 1e-9);
        assert!(x + width >= high[0] - 1e-9 && y + height >= high[1] - 1e-9);
        assert!(low[0] - x < 3.0 && low[1] - y < 3.0);
        assert!(x + width - high[0] < 3.0 && y + height - high[1] < 3.0);
    }
}

#[test]
fn an_approaching_ship_is_seen_further_along_the_flight() {
    for (displacement, row) in [(400.0, 60.0), (-400.0, 140.0)] {
        let ship = Track {
            azimuth_displacement: displacement,
            ..track(90.0, [0.0, 0.0])
        };
        let labels = Labels::new(Some(&ship), &square());
        assert!(close(labels.ship.position_px.unwrap(), [100.0, 100.0]));
        assert!(close(labels.ship.echo_px.unwrap(), [100.0, row]));
        let [x, y, width, height] = labels.ship.echo_box_px.unwrap();
        assert!(close([x, y], [90.0, row - 1.5]) && close([width, height], [20.0, 3.0]));
        // The wake stays at its place.
        assert!(close(labels.wake.apex_px.unwrap(), [110.0, 100.0]));
    }
    let gone = Track {
        azimuth_displacement: 1e5,
        ..track(270.0, [0.0, 0.0])
    };
    let ship = Labels::new(Some(&gone), &square()).ship;
    assert!(ship.echo_px.is_none() && ship.echo_box_px.is_none() && ship.position_px.is_some());
}

#[test]
fn a_ship_outside_may_leave_its_wake_inside() {
    let labels = Labels::new(Some(&track(0.0, [200.0, 5000.0])), &square());
    assert!(labels.ship.position_px.is_none() && labels.wake.apex_px.is_none());
    assert_eq!(labels.ship.position_m, Some([200.0, 5000.0]));
    let [from, to] = labels.wake.centreline_px.unwrap();
    assert!(close(from, [120.0, 0.0]) && close(to, [120.0, 200.0]));
    // 4100 m behind the bow the arms are 1450 m aside: outside; the wedge is the whole image.
    assert!(labels.wake.arms_px.is_empty());
    let [x, y, width, height] = labels.wake.box_px.unwrap();
    assert!(close([x, y], [0.0, 0.0]) && close([width, height], [200.0, 200.0]));
    // On the other side all has gone by.
    let ahead = Labels::new(Some(&track(180.0, [200.0, 5000.0])), &square());
    assert_eq!(ahead.wake, WakeLabel::default());
    assert_eq!(ahead.ship.speed, Some(10.0));
}

#[test]
fn nothing_is_labelled_where_nothing_is() {
    assert_eq!(Labels::new(None, &square()), Labels::default());
    let stopped = Track {
        speed: 0.0,
        ..track(0.0, [0.0, 0.0])
    };
    let labels = Labels::new(Some(&stopped), &square());
    assert_eq!(labels.wake, WakeLabel::default());
    assert!(labels.ship.echo_px.is_some());
    // An image of one pixel has no extent.
    let labels = Labels::new(Some(&track(30.0, [0.0, 0.0])), &Raster::image(1, 1, 10.0));
    assert_eq!(labels.wake, WakeLabel::default());
}

#[test]
fn json_has_the_stated_keys_and_empty_lists() {
    let full = Labels::new(Some(&track(30.0, [0.0, 0.0])), &square());
    let value = serde_json::to_value(&full).unwrap();
    for key in ["position_m", "position_px", "echo_px"] {
        assert_eq!(value["ship"][key].as_array().unwrap().len(), 2);
    }
    for key in ["heading", "speed", "azimuth_displacement_m"] {
        assert!(value["ship"][key].is_number());
    }
    for (key, length) in [
        ("apex_px", 2),
        ("arms_px", 2),
        ("centreline_px", 2),
        ("box_px", 4),
        ("oriented_box_px", 4),
    ] {
        assert_eq!(value["wake"][key].as_array().unwrap().len(), length);
    }
    let empty = serde_json::to_value(Labels::default()).unwrap();
    for key in [
        "apex_px",
        "arms_px",
        "centreline_px",
        "box_px",
        "oriented_box_px",
    ] {
        assert_eq!(empty["wake"][key], serde_json::json!([]));
    }
    assert_eq!(empty["ship"]["echo_px"], serde_json::json!([]));
    assert!(empty["ship"]["heading"].is_null());
    for labels in [full, Labels::default()] {
        // Through a value, not a text: serde_json reads floats to the last bit only on demand.
        let value = serde_json::to_value(&labels).unwrap();
        assert_eq!(serde_json::from_value::<Labels>(value).unwrap(), labels);
    }
}
