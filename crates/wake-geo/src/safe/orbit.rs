//! Motion of the platform.

use crate::error::Result;
use crate::limits::VECTORS;
use crate::time::UtcTime;
use crate::xml::Node;

/// Speed of light in vacuum \[m/s\].
const LIGHT: f64 = 299_792_458.0;

/// Platform speeds at the times of the state vectors, in the Earth-fixed frame.
#[derive(Clone, Debug)]
pub(crate) struct Orbit {
    states: Vec<(UtcTime, f64)>,
}

impl Orbit {
    /// Reads the list of state vectors of an annotation.
    pub(crate) fn read(list: Node<'_>) -> Result<Self> {
        let mut states: Vec<(UtcTime, f64)> = Vec::new();
        for node in list.children("orbit") {
            if states.len() == VECTORS {
                return Err(list.error(format!("it has more than {VECTORS} orbit state vectors")));
            }
            let text = node.get("time")?.text();
            let time = UtcTime::parse(text)
                .ok_or_else(|| node.error(format!("orbit state time is {text:?}, expected UTC")))?;
            let frame = node.find("frame").map_or("", Node::text);
            if !matches!(frame, "" | "Earth Fixed") {
                return Err(node.error(format!(
                    "the frame of an orbit state is {frame:?}, expected \"Earth Fixed\""
                )));
            }
            let squares = ["velocity/x", "velocity/y", "velocity/z"]
                .map(|path| node.number_in(path, -2e4, 2e4).map(|v| v * v));
            let [x, y, z] = squares;
            let speed = (x? + y? + z?).sqrt();
            if !(1e3..=2e4).contains(&speed) {
                return Err(node.error(format!(
                    "the speed of an orbit state is {speed} m/s, outside [1000, 20000]"
                )));
            }
            if states.last().is_some_and(|last| last.0 >= time) {
                return Err(node.error(format!("orbit state times do not increase at {time}")));
            }
            states.push((time, speed));
        }
        match states.is_empty() {
            true => Err(list.error("it has no orbit state vector")),
            false => Ok(Self { states }),
        }
    }

    /// Speed of the platform \[m/s\]: linear between state vectors, constant beyond.
    pub(crate) fn speed(&self, time: UtcTime) -> f64 {
        let states = &self.states;
        match states.partition_point(|state| state.0 <= time) {
            0 => states[0].1,
            end if end == states.len() => states[end - 1].1,
            i => {
                let (a, b) = (states[i - 1], states[i]);
                let t = time.seconds_since(a.0) / b.0.seconds_since(a.0);
                a.1 + t * (b.1 - a.1)
            }
        }
    }

    /// Slant range divided by platform speed \[s\], at a time and a two-way slant range time \[s\].
    pub(crate) fn range_to_velocity(&self, time: UtcTime, slant_range_time: f64) -> f64 {
        0.5 * LIGHT * slant_range_time / self.speed(time)
    }
}
