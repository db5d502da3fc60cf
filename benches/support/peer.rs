//! A peer that runs beside, so that a ratio is one of this machine at this time.

use crate::support::{median, timed};
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

const ROUNDS: usize = 5;

/// The process that runs peers on request (`benches/peer.py`).
pub struct Peer {
    process: Child,
    requests: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl Peer {
    /// In the folder that the environment variable `IDENT_PEERS` names: a copy of the peers' scripts, prepared as they say, with
    /// their Python environment in `venv`.
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

    /// Medians of own runs and of the peer's, taken in turn.
    pub fn beside<T>(&mut self, request: &str, mut own: impl FnMut() -> T) -> (f64, f64) {
        let (own, peer) = (0..ROUNDS).map(|_| (timed(1, &mut own).0, self.seconds(request))).unzip();
        (median(own), median(peer))
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
