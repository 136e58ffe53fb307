//! Prompt → 77 token ids.

use crate::cleaning::{Cleaned, clean};
use crate::error::Result;
use crate::vocabulary::{END_MARK, START_MARK, Vocabulary, to_symbols};
use rayon::prelude::*;
use std::path::Path;
use std::sync::LazyLock;
use tokenizers::utils::SysRegex;

/// Number of tokens that CLIP's text encoder takes, including start and end marks.
pub const TOKENS: usize = 77;

/// A tokenized prompt, the input of CLIP's text encoder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tokens {
    /// Start mark, words, end mark, padding.
    pub ids: [u32; TOKENS],
    /// `true` up to and including the end mark, `false` on the padding.
    pub mask: [bool; TOKENS],
    /// Number of tokens before truncation, including both marks.
    pub token_count: usize,
    /// Byte offset in the prompt of the first character that was cut off, always a character boundary.
    pub truncated_at: Option<usize>,
}

impl Tokens {
    /// Whether the prompt was truncated.
    pub fn truncated(&self) -> bool {
        self.truncated_at.is_some()
    }
}

/// CLIP's tokenizer: cleans the prompt, splits it into words and merges byte pairs.
///
/// Immutable; threads may share it.
///
/// # Examples
///
/// ```
/// let tokens = wake_text::Tokenizer::clip().encode("a photo of a cat");
/// assert_eq!(tokens.ids[..8], [49406, 320, 1125, 539, 320, 2368, 49407, 49407]);
/// assert_eq!(tokens.token_count, 7);
/// ```
///
/// # References
///
/// Radford et al. (2021), Learning Transferable Visual Models From Natural Language Supervision, section
/// 2.4; Sennrich et al. (2016), Neural Machine Translation of Rare Words with Subword Units, algorithm 1.
#[derive(Debug, Clone)]
pub struct Tokenizer {
    vocabulary: Vocabulary,
}

impl Tokenizer {
    /// The tokenizer of Stable Diffusion v1: CLIP's vocabulary of 49,408 tokens, padded with the end mark.
    ///
    /// The vocabulary is part of the crate; the first call in a process unpacks it.
    pub fn clip() -> &'static Self {
        static CLIP: LazyLock<Tokenizer> = LazyLock::new(|| {
            Tokenizer::new(Vocabulary::embedded().expect("the crate's own vocabulary is whole"))
        });
        &CLIP
    }

    /// Loads a tokenizer with the vocabulary of a folder, such as a Stable Diffusion model or its subfolder
    /// `tokenizer`. Only vocabulary, merges and padding token come from the folder; cleaning and splitting are
    /// CLIP's.
    ///
    /// Reads `vocab.json` and `merges.txt`, else `tokenizer.json`; and the padding token of
    /// `special_tokens_map.json`, if there is one.
    ///
    /// # Errors
    ///
    /// [`Error::NoVocabulary`](crate::Error::NoVocabulary) if none of these files is there,
    /// [`Error::File`](crate::Error::File) if one cannot be read,
    /// [`Error::Vocabulary`](crate::Error::Vocabulary) with the line where one is broken.
    pub fn from_folder(folder: &Path) -> Result<Self> {
        Vocabulary::from_folder(folder).map(Self::new)
    }

    /// Writes the files that transformers' `CLIPTokenizer` and [`Tokenizer::from_folder`] read:
    /// `vocab.json`, `merges.txt`, `special_tokens_map.json` and `tokenizer_config.json`.
    ///
    /// # Errors
    ///
    /// [`Error::Write`](crate::Error::Write) if a file cannot be written.
    pub fn save(&self, folder: &Path) -> Result<()> {
        self.vocabulary.save(folder, TOKENS)
    }

    fn new(vocabulary: Vocabulary) -> Self {
        Self { vocabulary }
    }

    /// Encodes a prompt as [`TOKENS`] token ids. A longer prompt is truncated; the end mark stays last.
    ///
    #[doc = include_str!("cleaning.md")]
    pub fn encode(&self, prompt: &str) -> Tokens {
        let cleaned = clean(prompt);
        let mut row = Row::new(&self.vocabulary);
        let mut from = 0;
        for (at, _) in cleaned.text.match_indices("<|") {
            let marks = [
                (START_MARK, self.vocabulary.start),
                (END_MARK, self.vocabulary.end),
            ];
            let found = marks
                .iter()
                .find(|(mark, _)| cleaned.text[at..].starts_with(mark));
            if let Some((mark, id)) = found {
                self.push_words(&cleaned.text, from..at, &mut row);
                row.push(*id, || at);
                from = at + mark.len();
            }
        }
        self.push_words(&cleaned.text, from..cleaned.text.len(), &mut row);
        row.finish(&cleaned)
    }

    /// Encodes many prompts on all cores, in their order.
    pub fn encode_batch<S: AsRef<str> + Sync>(&self, prompts: &[S]) -> Vec<Tokens> {
        prompts
            .par_iter()
            .map(|prompt| self.encode(prompt.as_ref()))
            .collect()
    }

    fn push_words(&self, text: &str, range: std::ops::Range<usize>, row: &mut Row) {
        for (from, to) in words().find_iter(&text[range.clone()]) {
            let start = range.start + from;
            let word = &text[start..range.start + to];
            let symbols = to_symbols(word);
            self.vocabulary.for_tokens(&symbols, |id, at| {
                row.push(id, || start + symbols[..at].chars().count());
            });
        }
    }
}

/// CLIP's words: an English contraction, a run of letters, one digit, or a run of other characters except white
/// space.
fn words() -> &'static SysRegex {
    const WORD: &str = r"'s|'t|'re|'ve|'m|'ll|'d|[\p{L}]+|[\p{N}]|[^\s\p{L}\p{N}]+";
    static PATTERN: LazyLock<SysRegex> =
        LazyLock::new(|| SysRegex::new(WORD).expect("a constant pattern"));
    &PATTERN
}

/// The 77 ids while they are being filled.
struct Row {
    ids: [u32; TOKENS],
    end: u32,
    /// Tokens so far, including those cut off.
    count: usize,
    /// Byte offset in the cleaned text of the first token that did not fit.
    cut: Option<usize>,
}

impl Row {
    fn new(vocabulary: &Vocabulary) -> Self {
        let mut ids = [vocabulary.pad; TOKENS];
        ids[0] = vocabulary.start;
        Self {
            ids,
            end: vocabulary.end,
            count: 1,
            cut: None,
        }
    }

    /// Appends a token that starts at byte `at` of the cleaned text.
    fn push(&mut self, id: u32, at: impl FnOnce() -> usize) {
        if self.count < TOKENS - 1 {
            self.ids[self.count] = id;
        } else if self.cut.is_none() {
            self.cut = Some(at());
        }
        self.count += 1;
    }

    fn finish(mut self, cleaned: &Cleaned) -> Tokens {
        let end = self.count.min(TOKENS - 1);
        self.ids[end] = self.end;
        Tokens {
            ids: self.ids,
            mask: std::array::from_fn(|i| i <= end),
            token_count: self.count + 1,
            truncated_at: self.cut.map(|at| cleaned.origin(at)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const START: u32 = 49406;
    const END: u32 = 49407;

    fn encode(prompt: &str) -> Tokens {
        Tokenizer::clip().encode(prompt)
    }

    fn assert_whole(prompt: &str, tokens: &Tokens) {
        let last = tokens.token_count.min(TOKENS) - 1;
        assert_eq!(
            (tokens.ids[0], tokens.ids[last], tokens.ids[76]),
            (START, END, END)
        );
        assert!(tokens.ids[last..].iter().all(|&id| id == END));
        assert!(tokens.ids.iter().all(|&id| id <= END));
        assert!((0..TOKENS).all(|i| tokens.mask[i] == (i <= last)));
        assert_eq!(tokens.truncated(), tokens.token_count > TOKENS);
        if let Some(at) = tokens.truncated_at {
            assert!(at < prompt.len() && prompt.is_char_boundary(at), "{at}");
        }
    }

    #[test]
    fn hard_prompts_have_77_tokens() {
        let long = "x".repeat(10_000);
        let words = "ship ".repeat(2_000);
        let digits = "1".repeat(10_000);
        let cjk = "海".repeat(10_000);
        let prompts = [
            "",
            " ",
            "\n\t",
            "\0\u{1}\u{7F}",
            "\u{200B}",
            "\u{202E}abc\u{202C}",
            "🚢🌊👨‍👩‍👧‍👦🏽",
            "海洋波浪 船の航跡",
            "<|endoftext|>",
            "<|startoftext|><|endoftext|>",
            "<|",
            "&",
            "&amp",
            "&#xD800;",
            "&#99999999999;",
            "\u{301}",
            "\u{FFFD}\u{10FFFF}",
            &long,
            &words,
            &digits,
            &cjk,
        ];
        for prompt in prompts {
            assert_whole(prompt, &encode(prompt));
        }
        assert_eq!(encode("").token_count, 2);
        assert_eq!(encode(&words).token_count, 2_002);
        assert_eq!(encode(&digits).token_count, 10_002);
    }

    #[test]
    fn contractions_are_words_of_their_own() {
        let text = "i've 's'll !'s 'x don't 12";
        let found: Vec<&str> = words()
            .find_iter(text)
            .map(|(from, to)| &text[from..to])
            .collect();
        let expected = [
            "i", "'ve", "'s", "'ll", "!'", "s", "'", "x", "don", "'t", "1", "2",
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn marks_within_a_prompt_become_their_tokens() {
        let tokens = encode("!!<|ENDOFTEXT|>ship<|startoftext|>");
        assert_eq!(tokens.ids[..6], [START, 748, END, 1158, START, END]);
        assert_eq!(tokens.token_count, 6);
    }

    #[test]
    fn the_cut_is_where_the_first_lost_token_starts() {
        let fits = "ship ".repeat(75);
        assert_eq!(encode(&fits).truncated_at, None);
        assert_eq!(encode(&fits).token_count, 77);
        assert_eq!(
            encode(&format!("{fits}  wake")).truncated_at,
            Some(fits.len() + 2)
        );
        // 74 words, then one of three tokens, of which only the first fits.
        let word = encode(&format!("{}1.5", "ship ".repeat(74)));
        assert_eq!(word.truncated_at, Some(74 * 5 + 1));
    }

    #[test]
    fn the_cut_is_counted_in_the_prompt_not_in_the_cleaned_text() {
        let prompt = format!("{}\u{FB01}n &amp; \u{65E5}", "e\u{301} ".repeat(75));
        assert_eq!(encode(&prompt).truncated_at, Some(75 * 4));
        let prompt = format!("&lt;{}\u{65E5}", " ship".repeat(74));
        assert_eq!(encode(&prompt).truncated_at, Some(4 + 74 * 5));
    }

    #[test]
    fn a_batch_is_its_prompts_in_order() {
        let prompts: Vec<String> = (0..1000).map(|i| format!("ship {i} {}", i % 7)).collect();
        let batch = Tokenizer::clip().encode_batch(&prompts);
        let single: Vec<Tokens> = prompts.iter().map(|prompt| encode(prompt)).collect();
        assert_eq!(batch, single);
    }

    /// The same tokenizer, assembled from the crate `tokenizers` as CLIP's `tokenizer.json` describes it.
    fn pipeline() -> tokenizers::Tokenizer {
        use tokenizers::normalizers::{Lowercase, NFC, Replace, Sequence};
        use tokenizers::pre_tokenizers::{byte_level::ByteLevel, sequence, split};
        use tokenizers::{SplitDelimiterBehavior, models::bpe::BPE, normalizers::replace};
        let (vocab, merges) = Vocabulary::clip_parts().unwrap();
        let bpe = BPE::builder()
            .vocab_and_merges(vocab, merges)
            .end_of_word_suffix("</w>".into())
            .build()
            .unwrap();
        let words = r"'s|'t|'re|'ve|'m|'ll|'d|[\p{L}]+|[\p{N}]|[^\s\p{L}\p{N}]+";
        let spaces = Replace::new(replace::ReplacePattern::Regex(r"\s+".into()), " ").unwrap();
        let words = split::SplitPattern::Regex(words.into());
        let words = split::Split::new(words, SplitDelimiterBehavior::Removed, true).unwrap();
        let bytes = ByteLevel::new(false, true, false);
        let mut tokenizer = tokenizers::Tokenizer::new(bpe);
        let normalizer = Sequence::new(vec![NFC.into(), spaces.into(), Lowercase.into()]);
        tokenizer.with_normalizer(Some(normalizer)).unwrap();
        let splitter = sequence::Sequence::new(vec![words.into(), bytes.into()]);
        tokenizer.with_pre_tokenizer(Some(splitter));
        tokenizer
    }

    fn assert_agrees(pipeline: &tokenizers::Tokenizer, prompt: &str) {
        // The pipeline lowers Σ letter by letter and cleans less; the two agree on text that cleaning leaves
        // unchanged.
        let cleaned = clean(prompt).text;
        if cleaned.contains(['ς', '&']) || cleaned.contains("<|") || clean(&cleaned).text != cleaned
        {
            return;
        }
        let expected = pipeline.encode_fast(cleaned.as_str(), false).unwrap();
        let tokens = encode(&cleaned);
        assert_eq!(
            tokens.token_count,
            expected.get_ids().len() + 2,
            "{cleaned:?}"
        );
        let count = expected.get_ids().len().min(75);
        assert_eq!(
            tokens.ids[1..=count],
            expected.get_ids()[..count],
            "{cleaned:?}"
        );
    }

    #[test]
    fn the_pipeline_of_the_crate_tokenizers_gives_the_same_ids() {
        let pipeline = pipeline();
        let config = ProptestConfig::with_cases(1000);
        let text = "\\PC{0,40}|([a-z]{1,9}('s|'ll|'re)?[ ,.]){0,20}|[ -~]{0,80}|[\u{A0}-\u{2FF}\u{400}-\u{52F}\u{3040}-\u{9FFF}]{0,20}";
        proptest!(config, |(prompt in text)| assert_agrees(&pipeline, &prompt));
    }

    proptest! {
        #[test]
        fn any_text_has_77_tokens(prompt in any::<String>()) {
            assert_whole(&prompt, &encode(&prompt));
        }

        #[test]
        fn long_text_has_77_tokens(prompt in "(\\PC{0,9}|<\\|endoftext\\|>|&[a-z#]{1,4};|[\\x00-\\x20]){0,200}") {
            assert_whole(&prompt, &encode(&prompt));
        }

        /// The prompt up to the cut has exactly the tokens that were kept.
        #[test]
        fn the_prompt_up_to_the_cut_fills_the_row(
            words in prop::collection::vec("[a-z]{1,3}|[0-9]|&amp;|e\u{301}|\u{FB02}|\u{65E5}", 76..200)
        ) {
            let prompt = words.join(" ");
            let tokens = encode(&prompt);
            let cut = tokens.truncated_at.unwrap();
            prop_assume!(prompt[..cut].ends_with(' '));
            let kept = encode(&prompt[..cut]);
            prop_assert_eq!(kept.ids, tokens.ids);
            prop_assert_eq!(kept.token_count, TOKENS);
        }
    }
}
