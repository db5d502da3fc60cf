//! A peer that runs beside, so that a ratio is one of this machine at this time.

use crate::support::{median, timed};
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Instant;

/// Most pairs of runs, and the seconds after which no further one begins.
const ROUNDS: usize = 11;
const LONG: f64 = 60.0;

/// Medians of runs taken in turn.
pub struct Pairs {
    /// Seconds of own runs.
    pub own: f64,
    /// Seconds of the peer's.
    pub peer: f64,
    /// Median of the pairs' ratios: what slows a machine down for a while slows both.
    pub ratio: f64,
}

/// The process that runs peers on request (`benches/peer.py`).
pub struct Peer {
    process: Child,
    requests: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl Peer {
    /// In the folder that the environment variable `IDENT_PEERS` names: a copy of the peers' scripts, prepared as they
    /// say, with their Python environment in `venv`.
    pub fn start() -> Option<Self> {
        let folder = std::env::var_os("IDENT_PEERS").map(std::path::PathBuf::from)?;
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peer.py");
        let mut process = Command::new(folder.join("venv/bin/python"))
            .arg(script)
            .env("PYTHONPATH", &folder)
            .current_dir(&folder)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the peers' Python in $IDENT_PEERS/venv");
        let requests = process.stdin.take().expect("its input");
        let answers = BufReader::new(process.stdout.take().expect("its output"));
        Some(Self { process, requests, answers })
    }

    fn seconds(&mut self, request: &str) -> f64 {
        writeln!(self.requests, "{request}").expect("a peer that listens");
        let mut answer = String::new();
        self.answers.read_line(&mut answer).expect("a peer that answers");
        answer.trim().parse().unwrap_or_else(|_| panic!("`{request}`: the peer says `{answer}`"))
    }

    /// Own runs and the peer's in turn.
    pub fn beside<T>(&mut self, request: &str, mut own: impl FnMut() -> T) -> Pairs {
        own();
        let (begin, mut pairs) = (Instant::now(), Vec::new());
        while pairs.len() < ROUNDS && (pairs.is_empty() || begin.elapsed().as_secs_f64() < LONG) {
            pairs.push((timed(1, &mut own).0, self.seconds(request)));
        }
        let of = |value: fn(&(f64, f64)) -> f64| median(pairs.iter().map(value).collect());
        Pairs { own: of(|(own, _)| *own), peer: of(|(_, peer)| *peer), ratio: of(|(own, peer)| own / peer) }
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
