//! Scene → prompt.

use crate::error::Result;
use crate::statement::PartialScene;
use wake_physics::Scene;

/// One way to say a scene in words.
///
/// All state the same values, and all of them can be read back. Different words for the
/// same scene keep a text encoder from learning one sentence by heart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Wording {
    /// The words of Kamirul, Pappas and Achim:
    ///
    /// ```text
    /// Simulated SAR image of wakes from a ship moving at 10 mps toward 135 degrees. Ocean waves are shaped
    /// by 3 mps wind directing toward 90 degrees and 10000 meter fetch. Captured at 32 degree incidence.
    /// ```
    #[default]
    Paper,
    /// Wind first:
    ///
    /// ```text
    /// Wind of 3 mps blows toward 90 degrees over a fetch of 10000 meter. A ship moves toward 135 degrees
    /// at 10 mps and leaves a wake. Simulated SAR image at 32 degree incidence.
    /// ```
    WindFirst,
    /// Radar first:
    ///
    /// ```text
    /// SAR simulation at an incidence of 32 degrees. The wake of a ship with speed 10 mps and heading 135
    /// degrees. Sea under a wind of 3 mps toward 90 degrees, fetch 10000 meter.
    /// ```
    RadarFirst,
    /// As few words as possible:
    ///
    /// ```text
    /// SAR ship wake, ship 10 mps toward 135 degrees, wind 3 mps toward 90 degrees, fetch 10000 meter,
    /// incidence 32 degrees.
    /// ```
    Brief,
}

impl Wording {
    /// Every wording, the paper's first.
    pub const ALL: [Self; 4] = [Self::Paper, Self::WindFirst, Self::RadarFirst, Self::Brief];

    /// The prompt of a scene: ASCII, at most 77 tokens.
    ///
    /// Numbers are rounded as in [`PartialScene::of`]. Without a ship the prompt speaks of "open sea without
    /// a ship"; where the wind rounds to 0 m/s, of "no wind", and states neither direction nor fetch.
    ///
    /// # Errors
    ///
    /// [`Error::Scene`](crate::Error::Scene) if the scene is not valid.
    pub fn prompt(self, scene: &Scene) -> Result<String> {
        scene.validate()?;
        let said = PartialScene::of(scene);
        let ship = said.ship_speed.zip(said.ship_heading);
        let wind = said.wind_toward.zip(said.fetch);
        let wind = said.wind_speed.zip(wind);
        let wind = wind.map(|(speed, (toward, fetch))| [speed, toward, fetch]);
        let incidence = said.incidence.unwrap_or_default();
        Ok(match self {
            Self::Paper => paper(ship, wind, incidence),
            Self::WindFirst => wind_first(ship, wind, incidence),
            Self::RadarFirst => radar_first(ship, wind, incidence),
            Self::Brief => brief(ship, wind, incidence),
        })
    }
}

/// The prompt of a scene in the paper's words, [`Wording::Paper`].
///
/// # Errors
///
/// [`Error::Scene`](crate::Error::Scene) if the scene is not valid.
///
/// # Examples
///
/// ```
/// let mut scene = wake_physics::Scene::default();
/// scene.ship = None;
/// assert_eq!(
///     wake_text::prompt(&scene)?,
///     "Simulated SAR image of open sea without a ship. Ocean waves are shaped by 5 mps wind directing \
///      toward 90 degrees and 40000 meter fetch. Captured at 32 degree incidence."
/// );
/// # Ok::<(), wake_text::Error>(())
/// ```
pub fn prompt(scene: &Scene) -> Result<String> {
    Wording::Paper.prompt(scene)
}

/// Speed and heading, if there is a ship.
type Ship = Option<(f64, f64)>;
/// Speed, direction and fetch, if there is wind.
type Wind = Option<[f64; 3]>;

fn paper(ship: Ship, wind: Wind, incidence: f64) -> String {
    let ship = match ship {
        Some((speed, heading)) => format!(
            "wakes from a ship moving at {speed} mps toward {heading} degrees"
        ),
        None => "open sea without a ship".to_owned(),
    };
    let wind = match wind {
        Some([speed, toward, fetch]) => format!(
            "Ocean waves are shaped by {speed} mps wind directing toward {toward} degrees and {fetch} meter fetch"
        ),
        None => "The ocean is flat without wind".to_owned(),
    };
    format!("Simulated SAR image of {ship}. {wind}. Captured at {incidence} degree incidence.")
}

fn wind_first(ship: Ship, wind: Wind, incidence: f64) -> String {
    let wind = match wind {
        Some([speed, toward, fetch]) => format!(
            "Wind of {speed} mps blows toward {toward} degrees over a fetch of {fetch} meter"
        ),
        None => "No wind blows".to_owned(),
    };
    let ship = match ship {
        Some((speed, heading)) => format!(
            "A ship moves toward {heading} degrees at {speed} mps and leaves a wake"
        ),
        None => "Open sea without a ship".to_owned(),
    };
    format!("{wind}. {ship}. Simulated SAR image at {incidence} degree incidence.")
}

fn radar_first(ship: Ship, wind: Wind, incidence: f64) -> String {
    let ship = match ship {
        Some((speed, heading)) => {
            format!("The wake of a ship with speed {speed} mps and heading {heading} degrees")
        }
        None => "Open sea without a ship".to_owned(),
    };
    let wind = match wind {
        Some([speed, toward, fetch]) => {
            format!("Sea under a wind of {speed} mps toward {toward} degrees, fetch {fetch} meter")
        }
        None => "Flat sea without wind".to_owned(),
    };
    format!("SAR simulation at an incidence of {incidence} degrees. {ship}. {wind}.")
}

fn brief(ship: Ship, wind: Wind, incidence: f64) -> String {
    let ship = match ship {
        Some((speed, heading)) => {
            format!("SAR ship wake, ship {speed} mps toward {heading} degrees")
        }
        None => "SAR open sea, no ship".to_owned(),
    };
    let wind = match wind {
        Some([speed, toward, fetch]) => {
            format!("wind {speed} mps toward {toward} degrees, fetch {fetch} meter")
        }
        None => "no wind".to_owned(),
    };
    format!("{ship}, {wind}, incidence {incidence} degrees.")
}
