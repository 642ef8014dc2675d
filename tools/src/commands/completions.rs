use clap_complete::Shell;
use std::io::Write;

/// Print a script that completes gyronet's arguments in a shell.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  source <(gyronet completions bash)                                # for this session
  gyronet completions zsh > ~/.zfunc/_gyronet                       # a folder of fpath
  gyronet completions fish > ~/.config/fish/completions/gyronet.fish")]
pub struct Args {
    /// Shell that runs the script.
    #[arg(value_enum, value_name = "SHELL")]
    shell: Shell,
}

pub fn run(args: &Args, mut command: clap::Command) -> super::Result {
    let name = command.get_name().to_owned();
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, name, &mut script);
    Ok(std::io::stdout().lock().write_all(&script)?)
}
