//! Names of parameters in files.
//!
//! | here | in the file |
//! | --- | --- |
//! | `gamma`, `beta` of a layer norm | `weight`, `bias` |
//! | `to_out` | `to_out.0` |
//! | `ff.proj`, `ff.out` | `ff.net.0.proj`, `ff.net.2` |
//! | `attentions.0.attention.to_q` (autoencoder) | `attentions.0.to_q` |
//! | `layers`, `…_embedding`, `final_layer_norm` (text) | below `text_model`, `.encoder`, `.embeddings` |

/// Naming scheme of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// U-Net and autoencoder, as diffusers writes them.
    Diffusers,
    /// The text encoder, as transformers writes it.
    ClipText,
}

/// Path of a parameter in a model.
#[derive(Debug, Default)]
pub(super) struct ModulePath {
    segments: Vec<(String, String)>,
}

impl ModulePath {
    /// Enters the module `name` of a container.
    pub(super) fn enter(&mut self, name: &str, container: &str) {
        self.segments.push((name.to_owned(), container.to_owned()));
    }

    /// Leaves the module that was entered last.
    pub(super) fn exit(&mut self) {
        self.segments.pop();
    }

    /// Whether a file holds the transpose, as for the matrices of linear layers.
    pub(super) fn is_transposed(&self, rank: usize) -> bool {
        let owner = self
            .segments
            .iter()
            .rev()
            .find(|(_, container)| container.starts_with("Struct:"));
        rank == 2 && owner.is_some_and(|(_, container)| container == "Struct:Linear")
    }

    /// Name of the parameter in a file.
    pub(super) fn file_name(&self, layout: Layout) -> String {
        // The variants of an enum of layers do not count as a level.
        let segments = self.segments.iter().map(|(name, _)| name.as_str());
        let segments: Vec<&str> = segments
            .filter(|name| !["Conv", "Linear"].contains(name))
            .collect();
        let plain = segments.join(".");
        match layout {
            Layout::Diffusers => renamed(&plain),
            Layout::ClipText => below_text_model(&renamed(&plain)),
        }
    }
}

const RENAMED: [(&str, &str); 6] = [
    (".gamma", ".weight"),
    (".beta", ".bias"),
    (".to_out.", ".to_out.0."),
    (".ff.proj.", ".ff.net.0.proj."),
    (".ff.out.", ".ff.net.2."),
    (".attention.", "."),
];

fn renamed(name: &str) -> String {
    RENAMED.iter().fold(name.to_owned(), |name, (here, there)| {
        name.replace(here, there)
    })
}

fn below_text_model(name: &str) -> String {
    let part = match name {
        _ if name.starts_with("layers.") => "encoder.",
        _ if name.contains("_embedding.") => "embeddings.",
        _ => "",
    };
    format!("text_model.{part}{name}")
}

/// Current name of a tensor, which older files may name differently.
pub(super) fn modern(name: &str) -> String {
    const OLD: [(&str, &str); 4] = [
        (".query.", ".to_q."),
        (".key.", ".to_k."),
        (".value.", ".to_v."),
        (".proj_attn.", ".to_out.0."),
    ];
    OLD.iter()
        .fold(name.to_owned(), |name, (old, new)| name.replace(old, new))
}

/// Whether a tensor is a buffer, which files hold and models do not need.
pub(super) fn is_buffer(name: &str) -> bool {
    name.ends_with(".position_ids")
}
