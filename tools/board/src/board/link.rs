//! The process of the model, which reads a JSON object per line and answers with one.

use crate::recordings::workspace;
use crate::wire::bytes;
use serde_json::Value;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// The model's process and its pipes. Dropping this value ends the process.
#[derive(Debug)]
pub struct Link {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl Link {
    pub fn open(python: &str, image: &Path, chip: &str) -> Self {
        let mut child = Command::new(python)
            .args(["-m", "virtual_board", "--chip", chip, "--elf"])
            .arg(image)
            .current_dir(workspace().join("host-tests/board"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("{python}: {error}"));
        let input = child.stdin.take().expect("piped");
        let output = BufReader::new(child.stdout.take().expect("piped"));
        Self { child, input, output }
    }

    pub fn ask(&mut self, command: &str, mut arguments: Value) -> Result<Value, String> {
        arguments["command"] = command.into();
        let gone = |error| format!("the model has ended: {error}");
        writeln!(self.input, "{arguments}").and_then(|()| self.input.flush()).map_err(gone)?;
        let mut line = String::new();
        self.output.read_line(&mut line).map_err(gone)?;
        let answer: Value = serde_json::from_str(&line).map_err(|error| format!("{line:?}: {error}"))?;
        match answer.get("error").and_then(Value::as_str) {
            Some(error) => Err(error.to_owned()),
            None => Ok(answer),
        }
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        // The process may have ended already, and nothing depends on how it ends.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

pub fn unhex(digits: &Value) -> Vec<u8> {
    bytes(digits.as_str().expect("the model gives digits"))
}
