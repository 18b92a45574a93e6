//! The command line: see [`eixo::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    eixo::cli::main()
}
