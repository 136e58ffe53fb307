//! Sheet of the stages from hull to image, a panel each.

use super::levels::{filling, signed};
use crate::sheet::Picture;
use wake_physics::{Field, Result, Scene, simulate};

/// Eight panels, four in a row.
pub(crate) fn sheet() -> Result<Picture> {
    let scene = Scene::default().with_assignments(&[
        "grid.rows=240",
        "grid.columns=240",
        "grid.spacing=3",
        "sea.wind_speed=4",
        "sea.wind_toward=120",
        "ship.length=120",
        "ship.beam=18",
        "ship.draft=7",
        "ship.speed=8",
        "ship.heading=50",
        "ship.position=[190, 160]",
        "ship.echo=true",
        "ship.steepness=0.2",
        "radar.looks=2",
        "model.terms=all",
    ])?;
    let still = simulate(&scene.with_assignments(&["sea.wind_speed=0"])?)?;
    let open = simulate(&Scene::from_toml(&without_ship(&scene)?)?)?;
    let all = simulate(&scene)?;
    let sharp = simulate(&scene.with_assignments(&["radar.range_to_velocity=0"])?)?;
    let wide = 240;
    let panel =
        |levels: &[u8], caption: &str| Picture::from_levels(levels, wide).captioned(caption);
    let mut labelled = Picture::from_levels(&filling(&all.speckled), wide);
    labelled.draw_labels(&all.labels);
    let metres = |field: &Field| format!("{:.2} m", field.rms());
    let panels = [
        panel(
            &signed(&open.elevation),
            &format!("1 Sea: elevation, rms {}", metres(&open.elevation)),
        ),
        panel(
            &signed(&still.elevation),
            &format!("2 Wake: elevation, rms {}", metres(&still.elevation)),
        ),
        panel(
            &signed(&all.slope_x),
            &format!("3 Slope in range, rms {:.3}", all.slope_x.rms()),
        ),
        panel(
            &signed(&all.radial_velocity),
            &format!("4 Velocity, rms {:.2} m/s", all.radial_velocity.rms()),
        ),
        panel(&filling(&all.sigma0), "5 Backscatter (NRCS)"),
        panel(&filling(&sharp.intensity), "6 Image if nothing moved"),
        panel(&filling(&all.intensity), "7 Velocity bunching and blur"),
        labelled.captioned("8 Speckle of 2 looks; labels"),
    ];
    Ok(Picture::sheet(&panels, 4))
}

/// The scene file without its ship.
fn without_ship(scene: &Scene) -> Result<String> {
    let text = scene.to_toml()?;
    let mut inside = false;
    let lines = text.lines().filter(|line| {
        if line.starts_with('[') {
            inside = line.trim_matches(['[', ']']).starts_with("ship");
        }
        !inside
    });
    Ok(lines.collect::<Vec<_>>().join("\n"))
}
