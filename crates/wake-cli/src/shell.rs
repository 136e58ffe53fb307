//! `wake completions` and `wake man`: shell completions and manual pages.

use clap::{Args, Command};
use clap_complete::Shell;
use std::path::PathBuf;

use crate::exit::{self, Outcome};

/// Print the completion script of a shell.
#[derive(Args)]
#[command(
    after_help = "For bash: wake completions bash > ~/.local/share/bash-completion/completions/wake"
)]
pub(crate) struct Completions {
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

/// Write a manual page of each subcommand.
#[derive(Args)]
pub(crate) struct Man {
    /// Folder for the pages, created if absent
    #[arg(value_name = "DIR", default_value = "out/man")]
    out: PathBuf,
}

pub(crate) fn completions(arguments: &Completions, mut program: Command) -> Outcome<()> {
    let mut text = Vec::new();
    clap_complete::generate(arguments.shell, &mut program, "wake", &mut text);
    exit::say(String::from_utf8(text)?.trim_end())?;
    Ok(())
}

pub(crate) fn man(arguments: &Man, program: Command) -> Outcome<()> {
    let out = &arguments.out;
    whole_files::make_folder(out)?;
    clap_mangen::generate_to(program, out)
        .map_err(|error| format!("cannot write to {}: {error}", out.display()))?;
    exit::say(&format!(
        "manual pages in {}; read them with man -l {}/wake.1",
        out.display(),
        out.display()
    ))?;
    Ok(())
}
