//! How far long work has come, on stderr: a bar on a terminal, a line now and then in a log.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle, TermLike};
use std::io::{self, IsTerminal};
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};

/// Shows how many of `count` `things`, as runs, are done, and that work goes on.
pub(super) fn progress_bar(count: usize, things: &str) -> ProgressBar {
    let (target, bar) = if io::stderr().is_terminal() {
        (ProgressDrawTarget::stderr(), "{bar:40.cyan/blue} ")
    } else {
        (ProgressDrawTarget::term_like_with_hz(Box::new(Log::new(io::stderr())), 1), "")
    };
    let template = format!("{bar}{{pos}}/{{len}} {things}  {{msg}}  {{elapsed_precise}}");
    let style = ProgressStyle::with_template(&template).unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::with_draw_target(Some(count as u64), target).with_style(style);
    // Of what nothing is counted in, the clock goes on.
    bar.enable_steady_tick(Duration::from_secs(1));
    bar
}

/// Tells a bar how many simulations of how many a study has done of what causes would do; `then` is what comes after them.
pub(super) fn simulations<'b>(bar: &'b ProgressBar, then: &'static str) -> impl Fn(usize, usize) + Sync + 'b {
    move |done, of| {
        bar.set_length(of as u64);
        bar.set_position(done as u64);
        bar.set_message(if done < of { "what each cause would do" } else { then });
    }
}

/// What a bar takes for a terminal where lines stay: of what is drawn it writes a line after ten seconds, and then each time a
/// tenth more of the time has gone by.
#[derive(Debug)]
struct Log<W>(Mutex<State<W>>);

#[derive(Debug)]
struct State<W> {
    out: W,
    began: Instant,
    next: Duration,
    /// What has been drawn since the last flush.
    line: String,
}

impl<W> Log<W> {
    fn new(out: W) -> Self {
        Log(Mutex::new(State { out, began: Instant::now(), next: Duration::from_secs(10), line: String::new() }))
    }

    fn state(&self) -> MutexGuard<'_, State<W>> {
        self.0.lock().unwrap_or_else(|broken| broken.into_inner())
    }
}

impl<W: io::Write> State<W> {
    /// Ends what has been drawn, `elapsed` after the beginning.
    fn flush(&mut self, elapsed: Duration) -> io::Result<()> {
        let line = std::mem::take(&mut self.line);
        let line = line.trim();
        if line.is_empty() || elapsed < self.next {
            return Ok(());
        }
        self.next = (elapsed + Duration::from_secs(10)).max(elapsed.mul_f64(1.1));
        writeln!(self.out, "{line}")
    }
}

impl<W: io::Write + std::fmt::Debug + Send> TermLike for Log<W> {
    fn width(&self) -> u16 {
        160
    }

    fn move_cursor_up(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_down(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_right(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_left(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn write_line(&self, text: &str) -> io::Result<()> {
        self.write_str(text)
    }

    fn write_str(&self, text: &str) -> io::Result<()> {
        self.state().line.push_str(text);
        Ok(())
    }

    fn clear_line(&self) -> io::Result<()> {
        self.state().line.clear();
        Ok(())
    }

    fn flush(&self) -> io::Result<()> {
        let mut state = self.state();
        let elapsed = state.began.elapsed();
        state.flush(elapsed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_gets_a_line_after_ten_seconds_and_then_ever_fewer() {
        let log = Log::new(Vec::new());
        for second in 0..1000 {
            log.write_str(&format!("{second} s   ")).expect("memory takes it");
            log.state().flush(Duration::from_secs(second)).expect("memory takes it");
        }
        let written = String::from_utf8(log.state().out.clone()).expect("it is text");
        let lines: Vec<&str> = written.lines().collect();
        assert_eq!(lines[..4], ["10 s", "20 s", "30 s", "40 s"]);
        // Ten to 100 s, and ln 10 / ln 1.1 = 24 from there on.
        assert!((30..=34).contains(&lines.len()), "{lines:?}");
    }

    #[test]
    fn what_is_cleared_is_not_written() {
        let log = Log::new(Vec::new());
        log.write_str("half").expect("memory takes it");
        log.clear_line().expect("memory takes it");
        log.state().flush(Duration::from_secs(60)).expect("memory takes it");
        assert!(log.state().out.is_empty());
    }
}
