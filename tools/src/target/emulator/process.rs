//! This module runs QEMU as a process. Threads collect its output, so that QEMU never blocks, and QEMU is killed when
//! its owner is dropped.

use super::{EmulatorError, POLL, Result, START};
use std::fmt::Display;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Holds the bytes that a thread collects until its source ends.
#[derive(Debug, Default)]
pub(super) struct Collected {
    bytes: Mutex<Vec<u8>>,
    more: Condvar,
    ended: AtomicBool,
}

impl Collected {
    /// Waits until `enough` accepts the bytes or the timeout expires; returns the bytes and whether they were
    /// accepted.
    pub(super) fn wait(&self, limit: Duration, mut enough: impl FnMut(&[u8]) -> bool) -> (Vec<u8>, bool) {
        let bytes = self.bytes.lock().unwrap_or_else(PoisonError::into_inner);
        let (bytes, timeout) = self
            .more
            .wait_timeout_while(bytes, limit, |bytes| !enough(bytes))
            .unwrap_or_else(PoisonError::into_inner);
        (bytes.clone(), !timeout.timed_out())
    }

    /// Waits as [`Self::wait`] does, without copying the bytes; returns whether they were accepted.
    pub(super) fn holds(&self, limit: Duration, mut enough: impl FnMut(&[u8]) -> bool) -> bool {
        let bytes = self.bytes.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = self.more.wait_timeout_while(bytes, limit, |bytes| !enough(bytes));
        !waited.unwrap_or_else(PoisonError::into_inner).1.timed_out()
    }

    /// Copies the bytes to a sink until the source ends or the sink fails.
    pub(super) fn copy_to(&self, mut sink: impl Write) {
        let mut copied = 0;
        loop {
            let bytes = self.bytes.lock().unwrap_or_else(PoisonError::into_inner);
            let ended = || self.ended.load(Ordering::Acquire);
            let (bytes, _) = self
                .more
                .wait_timeout_while(bytes, START, |bytes| bytes.len() == copied && !ended())
                .unwrap_or_else(PoisonError::into_inner);
            let new = bytes[copied..].to_vec();
            drop(bytes);
            if (new.is_empty() && ended()) || sink.write_all(&new).is_err() {
                return;
            }
            copied += new.len();
        }
    }
}

/// Owns QEMU, which is killed on drop, and the threads that read from it.
#[derive(Debug)]
pub(super) struct Process {
    pub(super) child: Child,
    errors: Arc<Collected>,
    threads: Vec<JoinHandle<()>>,
}

impl Process {
    pub(super) fn start(mut command: Command) -> Result<Self> {
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(EmulatorError::Start)?;
        let stderr = child.stderr.take();
        let mut process = Self { child, errors: Arc::default(), threads: Vec::new() };
        if let Some(stderr) = stderr {
            process.errors = process.collect(stderr);
        }
        Ok(process)
    }

    fn collect(&mut self, mut source: impl Read + Send + 'static) -> Arc<Collected> {
        let collected = Arc::<Collected>::default();
        let sink = Arc::clone(&collected);
        self.threads.push(std::thread::spawn(move || {
            let mut chunk = [0; 4096];
            while let Ok(len @ 1..) = source.read(&mut chunk) {
                sink.bytes.lock().unwrap_or_else(PoisonError::into_inner).extend(&chunk[..len]);
                sink.more.notify_all();
            }
            sink.ended.store(true, Ordering::Release);
            sink.more.notify_all();
        }));
        collected
    }

    /// Accepts QEMU's connection for a line.
    pub(super) fn accept(&mut self, listener: &TcpListener) -> Result<Line> {
        let until = Instant::now() + START;
        listener.set_nonblocking(true)?;
        let stream = loop {
            if let Ok((stream, _)) = listener.accept() {
                break stream;
            }
            if let Ok(Some(status)) = self.child.try_wait() {
                return Err(self.failed(format!("ended at its start with {status}")));
            }
            self.sleep(until, "did not connect its lines")?;
        };
        stream.set_nonblocking(false)?;
        stream.set_nodelay(true)?;
        let received = self.collect(stream.try_clone()?);
        Ok(Line { stream, received })
    }

    /// Sleeps briefly; fails with `what` after the time `until`.
    pub(super) fn sleep(&self, until: Instant, what: impl Display) -> Result<()> {
        if Instant::now() > until {
            return Err(self.failed(what));
        }
        std::thread::sleep(POLL);
        Ok(())
    }

    /// Ends QEMU cleanly through its monitor, and returns everything that QEMU has written to standard error.
    pub(super) fn quit(&mut self) -> Result<String> {
        let asked = self.child.stdin.take().map(|mut monitor| monitor.write_all(b"quit\n"));
        if !matches!(asked, Some(Ok(()))) {
            return Err(self.failed("its monitor does not listen"));
        }
        let until = Instant::now() + START;
        while !matches!(self.child.try_wait(), Ok(Some(_))) {
            self.sleep(until, "does not quit")?;
        }
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
        Ok(self.errors())
    }

    pub(super) fn errors(&self) -> String {
        String::from_utf8_lossy(&self.errors.wait(Duration::ZERO, |_| true).0).into_owned()
    }

    pub(super) fn failed(&self, what: impl Display) -> EmulatorError {
        EmulatorError::Failed { what: what.to_string(), errors: self.errors() }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // QEMU may have ended already, so errors are ignored. Its connections close when it ends.
        let _ = self.child.kill();
        let _ = self.child.wait();
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

/// Holds a connection to QEMU.
#[derive(Debug)]
pub(super) struct Line {
    pub(super) stream: TcpStream,
    pub(super) received: Arc<Collected>,
}
