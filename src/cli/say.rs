//! What commands print. Work is not ended by a reader who leaves early, as `| head` does; a result that finds no place on a
//! full disk is an error.

use anyhow::Context;
use std::fmt::Arguments;
use std::io::{self, ErrorKind, Write};

/// Prints a result to stdout.
macro_rules! say {
    ($($words:tt)*) => { $crate::cli::say::result(format_args!($($words)*)) };
}

/// Prints a result and ends the line.
macro_rules! sayln {
    ($($words:tt)*) => { $crate::cli::say::result(format_args!("{}\n", format_args!($($words)*))) };
}

/// Tells on stderr what is no result.
macro_rules! tell {
    ($($words:tt)*) => { $crate::cli::say::aside(format_args!($($words)*)) };
}

/// Writes to stdout, and to nobody where nobody reads any more.
pub(super) fn result(words: Arguments<'_>) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_fmt(words).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error).context("stdout cannot be written"),
        _ => Ok(()),
    }
}

/// Writes a line to stderr, if that can be written at all.
pub(super) fn aside(words: Arguments<'_>) {
    let _ = writeln!(io::stderr(), "{words}");
}
