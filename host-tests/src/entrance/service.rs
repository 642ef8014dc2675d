//! This module tests the service line in both directions: requests to the board, replies to the host.

use super::ram_flash::RamFlash;
use super::records::SECTOR;
use super::{Seed, byte, take};
use crate::noise::Noise;
use crate::synthetic::idling;

use gyronet::health::{Faults, Status};
use gyronet::model::blob::CRC;
use gyronet::sample::Standstill;
use gyronet::service::calibrate::Task;
use gyronet::service::frame::{Deframer, MAX_MESSAGE, emit};
use gyronet::service::message::{AllCounters, Calibrate, Identity};
use gyronet::service::{Device, Reply, Request, SupportedHardware};
use gyronet::store::layout::SLOT_SIZE;
use gyronet::store::{Configuration, FogPart, ImuPart, Record};

const DRIVES: SupportedHardware = SupportedHardware {
    imus: &[ImuPart::XsensMti],
    fogs: &[FogPart::Dsp1760],
    bits_per_second: &[250_000, 500_000],
};

type Board = Device<RamFlash<SECTOR>, RamFlash<SLOT_SIZE>>;

/// Runs the service line: the first byte says whether there is flash and whether the rest comes as it is, or as
/// messages (length, content) whose frames are made to fit. Every answer must be one that the host reads, and a board
/// must start with everything that was stored.
pub fn line(mut data: &[u8]) {
    let choice = byte(&mut data);
    let mut board = Board::new(&DRIVES);
    let (records, slots) = (RamFlash::new(&[]), (choice & 2 != 0).then(|| RamFlash::new(&[])));
    board.begin((choice & 4 != 0).then_some(records), slots, choice & 8 == 0, Identity::UNKNOWN);
    // The same bytes go to the host's side, in case a board sends nonsense.
    let mut asker = Deframer::new();
    for byte in data {
        if let Some(Ok((number, reply))) = asker.receive::<Reply>(*byte) {
            let _ = emit(number, &reply);
        }
    }
    if choice & 1 == 0 {
        data.iter().for_each(|byte| answer(&mut board, *byte));
        return;
    }
    let mut noise = Noise::new(1);
    // Long enough for one calibration: 310 samples.
    let mut ticks = 0..310;
    while !data.is_empty() {
        let len = usize::from(byte(&mut data));
        let content = take(&mut data, len);
        framed(content).iter().for_each(|byte| answer(&mut board, *byte));
        if len == 0 {
            ticks.by_ref().for_each(|tick| {
                board.observe(
                    Some(&idling(tick, 0.001, &mut noise)),
                    0,
                    (Status::Ready, Faults::NONE),
                    Standstill::Still,
                )
            });
        }
    }
    board.configuration().check().expect("what it runs with was checked");
    board.calibration().check().expect("what it knows is in its ranges");
}

/// Gives a byte to the board and reads its answer.
fn answer(board: &mut Board, byte: u8) {
    let Some(frame) = board.receive(byte, &AllCounters::default()) else { return };
    let mut deframer = Deframer::new();
    let replies: Vec<_> = frame.iter().filter_map(|byte| deframer.receive::<Reply>(*byte)).collect();
    assert!(matches!(replies[..], [Ok(_)]), "{replies:?}");
}

/// Returns a message, whatever it is, numbered and in a frame.
fn framed(message: &[u8]) -> Vec<u8> {
    let mut content = vec![7];
    content.extend(&message[..message.len().min(MAX_MESSAGE)]);
    content.extend(CRC.checksum(&content).to_le_bytes());
    let mut frame = vec![0; content.len() + content.len() / 254 + 2];
    let len = cobs::encode(&content, &mut frame);
    frame.truncate(len);
    frame.push(0);
    frame
}

pub fn seeds() -> Vec<Seed> {
    let message = |request: &Request| {
        let frame = emit(7, request).expect("it fits");
        let mut decoded = vec![0; frame.len()];
        let len = cobs::decode(&frame[1..frame.len() - 1], &mut decoded).expect("COBS of our own");
        let content = &decoded[1..len - 4];
        [&[content.len() as u8][..], content].concat()
    };
    let configuration = Configuration { latitude_deg: Some(48.1), ..Configuration::DEFAULT };
    let set = Request::SetConfiguration { version: Configuration::VERSION, configuration };
    let start = Request::Calibrate(Calibrate::Start(Task::Mounting));
    let block =
        |offset| Request::WeightsBlock { offset, bytes: heapless::Vec::from_slice(&[0; 8]).expect("8") };
    let requests = [
        Request::Info,
        Request::GetConfiguration,
        Request::GetCalibration,
        Request::Log { after: 0 },
        Request::Counters,
        Request::Restart,
    ];
    let messages = |requests: &[Request]| requests.iter().flat_map(message).collect::<Vec<u8>>();
    let upload = [
        Request::WeightsBegin { length: 16 },
        block(0),
        block(8),
        Request::WeightsVerify,
        Request::WeightsActivate,
    ];
    let store = Request::Calibrate(Calibrate::Store);
    let line: Vec<u8> = requests.iter().flat_map(|request| emit(9, request).expect("it fits")).collect();
    vec![
        ("line", [&[6][..], &line].concat()),
        ("questions", [&[5][..], &messages(&requests)].concat()),
        ("configuration", [&[5][..], &messages(&[set, Request::GetConfiguration])].concat()),
        ("calibration", [&[5][..], &messages(&[start]), &[0], &messages(&[store])].concat()),
        ("upload", [&[7][..], &messages(&upload)].concat()),
    ]
}
