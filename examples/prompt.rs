//! A scene as a prompt and its 77 CLIP tokens; a prompt as the values it states.
//!
//! ```text
//! cargo run --no-default-features --example prompt -- --set ship.speed=12
//! cargo run --no-default-features --example prompt -- --text "A ship at 8 m/s in 5 m/s wind" --json
//! ```

#[path = "common/exit.rs"]
mod exit;

use clap::Parser;
use serde_json::{Value, json};
use std::error::Error;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use wake_physics::Scene;
use wake_text::{PartialScene, TOKENS, Tokenizer, Tokens};

/// Turns a scene into a prompt and its CLIP tokens, or reads a prompt back.
#[derive(Parser)]
struct Arguments {
    /// Scene file (TOML); without it and without --text, the default scene.
    #[arg(long, value_name = "FILE", conflicts_with = "text")]
    scene: Option<PathBuf>,
    /// A prompt of your own instead of a scene.
    #[arg(long, value_name = "TEXT")]
    text: Option<String>,
    /// Sets a value of the scene, such as ship.speed=12; may be repeated.
    #[arg(long, value_name = "KEY=VALUE", conflicts_with = "text")]
    set: Vec<String>,
    /// Prints one JSON object: prompt, ids, count, whether cut off, and the scene read back (or null).
    #[arg(long)]
    json: bool,
}

fn main() -> ExitCode {
    exit::code(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let text = answer(arguments)?;
    // A reader such as `head` may have left.
    let _ = writeln!(std::io::stdout(), "{text}");
    Ok(())
}

fn answer(arguments: &Arguments) -> Result<String, Box<dyn Error>> {
    let (prompt, base) = match &arguments.text {
        // A text has a ship only if it speaks of one.
        Some(text) => (
            text.clone(),
            Scene {
                ship: None,
                ..Scene::default()
            },
        ),
        None => {
            let scene = read_scene(arguments)?;
            (wake_text::prompt(&scene)?, scene)
        }
    };
    let said = PartialScene::read(&prompt)?;
    let tokens = Tokenizer::clip().encode(&prompt);
    if arguments.json {
        return Ok(as_json(&prompt, &tokens, &said, &base)?.to_string());
    }
    Ok(as_text(&prompt, &tokens, &said))
}

fn read_scene(arguments: &Arguments) -> wake_physics::Result<Scene> {
    let scene = match &arguments.scene {
        Some(file) => Scene::read(file)?,
        None => Scene::default(),
    };
    scene.with_assignments(&arguments.set)
}

/// `scene` holds the stated values on top of `base`; it is null if nothing is stated.
fn as_json(
    prompt: &str,
    tokens: &Tokens,
    said: &PartialScene,
    base: &Scene,
) -> Result<Value, Box<dyn Error>> {
    let scene = (!said.is_empty()).then(|| said.onto(base)).transpose()?;
    Ok(json!({
        "prompt": prompt,
        "token_ids": tokens.ids.to_vec(),
        "token_count": tokens.token_count,
        "truncated": tokens.truncated(),
        "scene": scene,
    }))
}

fn as_text(prompt: &str, tokens: &Tokens, said: &PartialScene) -> String {
    let mut lines = vec![prompt.to_owned(), String::new()];
    lines.push(format!("{} of {TOKENS} tokens", tokens.token_count));
    if let Some(at) = tokens.truncated_at {
        lines.push(format!("cut off from byte {at}: {}", &prompt[at..]));
    }
    let ids: Vec<String> = tokens.ids.iter().map(u32::to_string).collect();
    lines.extend(ids.chunks(11).map(|row| row.join(" ")));
    lines.push(String::new());
    lines.extend(stated(said));
    lines.join("\n")
}

/// The stated values under their keys in a scene file.
fn stated(said: &PartialScene) -> Vec<String> {
    let values = [
        ("ship.speed", said.ship_speed, "m/s"),
        ("ship.heading", said.ship_heading, "degrees"),
        ("sea.wind_speed", said.wind_speed, "m/s"),
        ("sea.wind_toward", said.wind_toward, "degrees"),
        ("sea.fetch", said.fetch, "m"),
        ("radar.incidence", said.incidence, "degrees"),
    ];
    let ship = match said.ship {
        Some(true) => "there is a ship",
        Some(false) => "there is no ship",
        None => "nothing is said of a ship",
    };
    let values = values
        .into_iter()
        .filter_map(|(key, value, unit)| Some(format!("{key} = {} {unit}", value?)));
    std::iter::once(ship.to_owned()).chain(values).collect()
}
