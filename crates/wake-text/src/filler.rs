//! Filler: words that change no value of a scene.
//!
//! A word that is neither listed here nor in the vocabulary of another module is unknown and reported as unread. List
//! a word here only if it never changes the meaning of a value.

/// Articles, pronouns and forms of "be" and "have".
const GRAMMAR: [&str; 29] = [
    "a", "an", "the", "one", "this", "that", "these", "those", "it", "its", "itself", "there",
    "here", "which", "we", "me", "i", "is", "are", "was", "were", "be", "been", "being", "has",
    "have", "having", "had", "any",
];

/// Prepositions and conjunctions.
const JOINTS: [&str; 29] = [
    "of", "in", "on", "at", "by", "to", "toward", "towards", "from", "under", "over", "onto",
    "for", "with", "and", "or", "but", "while", "as", "along", "near", "amid", "during", "out",
    "via", "upon", "where", "so", "also",
];

/// Words about images and how they are made.
const PICTURES: [&str; 52] = [
    "image",
    "images",
    "imagery",
    "picture",
    "pictures",
    "photo",
    "photograph",
    "scene",
    "scenes",
    "view",
    "frame",
    "sar",
    "synthetic",
    "aperture",
    "simulated",
    "simulation",
    "simulate",
    "sentinel",
    "prompt",
    "capture",
    "captured",
    "acquired",
    "acquisition",
    "taken",
    "recorded",
    "observed",
    "seen",
    "see",
    "visible",
    "sight",
    "show",
    "shows",
    "showing",
    "shown",
    "contain",
    "contains",
    "containing",
    "depict",
    "depicts",
    "depicting",
    "generate",
    "generated",
    "draw",
    "drawn",
    "create",
    "render",
    "make",
    "made",
    "please",
    "give",
    "want",
    "present",
];

/// Words about the sea, and verbs that ships, wind and waves take at any speed.
const SEA: [&str; 47] = [
    "sea",
    "seas",
    "ocean",
    "oceans",
    "water",
    "waters",
    "surface",
    "open",
    "night",
    "day",
    "first",
    "shaped",
    "shape",
    "driven",
    "raised",
    "leaves",
    "leave",
    "leaving",
    "trailing",
    "trails",
    "producing",
    "produces",
    "blow",
    "blows",
    "blowing",
    "blown",
    "doing",
    "does",
    "making",
    "makes",
    "keeping",
    "keeps",
    "holding",
    "holds",
    "pointing",
    "points",
    "directed",
    "oriented",
    "aimed",
    "aligned",
    "set",
    "sets",
    "underway",
    "equals",
    "value",
    "steady",
    "constant",
];

/// Whether a word is filler.
pub(crate) fn is_listed(word: &str) -> bool {
    let groups: [&[&str]; 4] = [&GRAMMAR, &JOINTS, &PICTURES, &SEA];
    groups.into_iter().any(|group| group.contains(&word))
}
