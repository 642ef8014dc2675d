//! A diagnostic tester written from ISO 15765-2, apart from the library's own transport.

use std::collections::VecDeque;

const PADDING: u8 = 0x55;

pub fn segment(message: &[u8]) -> Vec<[u8; 8]> {
    if message.len() <= 7 {
        return vec![frame(&[message.len() as u8], message)];
    }
    let [high, low] = (message.len() as u16).to_be_bytes();
    let (first, rest) = message.split_at(6);
    let consecutive = rest.chunks(7).zip(1u8..).map(|(bytes, number)| frame(&[0x20 | (number & 0xF)], bytes));
    std::iter::once(frame(&[0x10 | high, low], first)).chain(consecutive).collect()
}

pub fn frame(head: &[u8], bytes: &[u8]) -> [u8; 8] {
    let mut frame = [PADDING; 8];
    frame.iter_mut().zip(head.iter().chain(bytes)).for_each(|(place, byte)| *place = *byte);
    frame
}

/// A tester: sends a request as the server's flow control allows, accepts the whole response, and returns its bytes.
/// It waits on "response pending", and counts these responses.
#[derive(Debug, Default)]
pub struct Tester {
    pub pending: usize,
}

impl Tester {
    /// `exchange` passes frames to the server and returns those that it has sent; it is called until the response is
    /// complete, at most `turns` times.
    pub fn ask(
        &mut self,
        request: &[u8],
        turns: usize,
        mut exchange: impl FnMut(&[[u8; 8]]) -> Vec<[u8; 8]>,
    ) -> Option<Vec<u8>> {
        let mut waiting: VecDeque<_> = segment(request).into();
        // Number of frames that may be sent: the first frame.
        let mut granted = 1;
        let mut response: Option<(Vec<u8>, usize)> = None;
        let mut control = None;
        for _ in 0..turns {
            let count = waiting.len().min(granted);
            granted -= count;
            let out: Vec<_> = waiting.drain(..count).chain(control.take()).collect();
            for data in exchange(&out) {
                match (data[0] >> 4, &mut response) {
                    (0, _) => {
                        let message = data[1..=usize::from(data[0])].to_vec();
                        if matches!(message[..], [0x7F, _, 0x78]) {
                            self.pending += 1;
                        } else {
                            return Some(message);
                        }
                    }
                    (1, _) => {
                        let length = usize::from(data[0] & 0xF) << 8 | usize::from(data[1]);
                        response = Some((data[2..].to_vec(), length));
                        control = Some(frame(&[0x30, 0, 0], &[]));
                    }
                    (2, Some((bytes, length))) => {
                        bytes.extend(&data[1..]);
                        if bytes.len() >= *length {
                            bytes.truncate(*length);
                            return Some(bytes.clone());
                        }
                    }
                    (3, _) => granted = if data[1] == 0 { usize::MAX } else { usize::from(data[1]) },
                    _ => panic!("not a frame of a server: {data:02x?}"),
                }
            }
        }
        None
    }
}
