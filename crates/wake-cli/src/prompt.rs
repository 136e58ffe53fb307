//! `wake prompt`: turns a scene into a prompt and its 77 CLIP tokens, or reads the values of a prompt.

use clap::Args;
use serde_json::{Value, json};
use std::path::PathBuf;
use wake_physics::Scene;
use wake_text::{Reading, TOKENS, Tokenizer, Tokens};

use crate::exit::{self, Outcome};

/// Turn a scene into a prompt and its CLIP tokens, or read a prompt.
#[derive(Args)]
#[command(after_help = "Scene keys with their units, ranges and defaults: docs/scene_keys.md")]
pub(crate) struct Arguments {
    /// Scene file (TOML) [default: the default scene]
    #[arg(long, value_name = "FILE", conflicts_with = "text")]
    scene: Option<PathBuf>,
    /// Prompt to read, instead of a scene
    #[arg(long, value_name = "TEXT")]
    text: Option<String>,
    /// Set one value of the scene, such as ship.speed=12; may be repeated
    #[arg(long, value_name = "KEY=VALUE", conflicts_with = "text")]
    set: Vec<String>,
    /// Print one JSON object and nothing else: prompt, token ids and count, whether the prompt is truncated, stated
    /// values, the scene with these values (null if none is stated), and unread parts of the prompt
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    let text = answer(arguments)?;
    Ok(exit::say(&text)?)
}

fn answer(arguments: &Arguments) -> Outcome<String> {
    let (prompt, base) = match &arguments.text {
        // A text has a ship only if it mentions one.
        Some(text) => (
            text.clone(),
            Scene {
                ships: Vec::new(),
                ..Scene::default()
            },
        ),
        None => {
            let scene = read_scene(arguments)?;
            (wake_text::prompt(&scene)?, scene)
        }
    };
    let reading = Reading::of(&prompt)?;
    let tokens = Tokenizer::clip().encode(&prompt);
    if arguments.json {
        return Ok(as_json(&prompt, &tokens, &reading, &base)?.to_string());
    }
    Ok(as_text(&prompt, &tokens, &reading))
}

fn read_scene(arguments: &Arguments) -> wake_physics::Result<Scene> {
    let scene = match &arguments.scene {
        Some(file) => Scene::read(file)?,
        None => Scene::default(),
    };
    scene.with_assignments(&arguments.set)
}

/// Result as JSON. `scene` holds the stated values on top of `base`; it is null if nothing is stated.
fn as_json(prompt: &str, tokens: &Tokens, reading: &Reading, base: &Scene) -> Outcome<Value> {
    let scene = (!reading.states_nothing()).then(|| reading.scene.onto(base));
    let scene = scene.transpose()?;
    Ok(json!({
        "prompt": prompt,
        "token_ids": tokens.ids.to_vec(),
        "token_count": tokens.token_count,
        "truncated": tokens.truncated(),
        "stated": reading.scene,
        "scene": scene,
        "unread": reading.unread,
    }))
}

fn as_text(prompt: &str, tokens: &Tokens, reading: &Reading) -> String {
    let mut lines = vec![prompt.to_owned(), String::new()];
    lines.push(format!("{} of {TOKENS} tokens", tokens.token_count));
    if let Some(at) = tokens.truncated_at {
        lines.push(format!("cut off from byte {at}: {}", &prompt[at..]));
    }
    let ids: Vec<String> = tokens.ids.iter().map(u32::to_string).collect();
    lines.extend(ids.chunks(11).map(|row| row.join(" ")));
    lines.push(String::new());
    lines.push(reading.to_string());
    lines.join("\n")
}
