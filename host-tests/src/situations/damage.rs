//! Damage to the bytes of the sensor's line: lost, doubled, wrong, late.

use super::sensor::{During, Message};
use gyronet_tools::random::Random;

/// The fate of each message while the damage lasts.
#[derive(Debug, Clone, Copy)]
pub enum Damage {
    /// This share of the messages is lost.
    Drop(f64),
    Twice(f64),
    BitFlip(f64),
    /// Up to this many bytes are noise.
    Burst(f64, usize),
    Truncation(f64),
    /// The next message overtakes.
    Late(f64),
    /// Everything waits, and comes at the end.
    Stall,
}

pub fn damaged(messages: Vec<Message>, damage: &[During<Damage>], random: &mut Random) -> Vec<Message> {
    let mut out = Vec::with_capacity(messages.len());
    for mut message in messages {
        let at = message.at;
        let mut copies = 1;
        for during in damage.iter().filter(|during| during.holds(at)) {
            let bytes = message.bytes.len();
            match during.what {
                Damage::Drop(share) if random.chance(share) => copies = 0,
                Damage::Twice(share) if random.chance(share) => copies = 2,
                Damage::BitFlip(share) if random.chance(share) => {
                    let bit = random.below(8 * bytes);
                    message.bytes[bit / 8] ^= 1 << (bit % 8);
                }
                Damage::Burst(share, longest) if random.chance(share) => {
                    let from = random.below(bytes);
                    let to = bytes.min(from + 1 + random.below(longest));
                    message.bytes[from..to].fill_with(|| random.bits() as u8);
                }
                Damage::Truncation(share) if random.chance(share) => {
                    message.bytes.truncate(random.below(bytes))
                }
                Damage::Late(share) if random.chance(share) => message.at += 0.011,
                Damage::Stall => message.at = during.to,
                _ => {}
            }
        }
        out.extend(std::iter::repeat_n(message, copies));
    }
    out.sort_by(|one, other| one.at.total_cmp(&other.at));
    out
}
