//! Real drives that training has not seen: the README's ratios to static initialisation, drive by drive.

use gyronet::model::{Blob, GyroNet, weights};
use gyronet_host_tests::{parallel, recordings};
use gyronet_tools::board::Board;
use gyronet_tools::calibrate::{Cut, calibrate, config};
use gyronet_tools::drive::stream::Drive;
use gyronet_tools::evaluate::methods::{Method, PerMethod};
use gyronet_tools::evaluate::rates::Networks;
use gyronet_tools::evaluate::report::{DriveErrors, Report, Row};

const TRIALS: [u32; 2] = [9, 11];

/// A change for the worse by more than this share of the README's number fails; one for the better is worth a new number.
const WORSE: f64 = 0.05;

/// The rows of the page of measurements: how each begins, and its method. Its second number is the ratio of both drives to
/// static initialisation, behind which stand those of each drive.
const ROWS: [(&str, Method); 2] =
    [("| gyronet, live rate |", Method::LIVE), ("| gyronet, delayed rate |", Method::DELAYED)];
/// The README's sentence with the ratio to the best classical method, which stands before these words.
const OVER_BEST_CLASSICAL: &str = " of the best classical method's";

/// The numbers in a page's row that begins so: `(0.78 (0.95 and 0.72)` gives all three.
fn numbers(page: &str, row: &str) -> Vec<f64> {
    let text = std::fs::read_to_string(recordings::workspace().join(page)).expect("a page");
    let line = text.lines().find_map(|line| line.strip_prefix(row));
    let line = line.unwrap_or_else(|| panic!("{page} has no row {row}"));
    let numbers = line.split(|c: char| !c.is_ascii_digit() && c != '.').filter_map(|word| word.parse().ok());
    numbers.filter(|number: &f64| number.fract() != 0.0).collect()
}

/// Wherever the lines of the README break.
fn number_before(words: &str) -> f64 {
    let text = std::fs::read_to_string(recordings::workspace().join("README.md")).expect("a page");
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let before = text.split_once(words).unwrap_or_else(|| panic!("README.md does not say{words}")).0;
    before.rsplit(' ').next().and_then(|word| word.parse().ok()).expect("a number")
}

fn hold(what: &str, ratio: f64, readme: f64) {
    println!("{what}: {ratio:.3}; the page says {readme}");
    assert!(ratio <= readme * (1.0 + WORSE), "{what}: {ratio:.3}, the page says {readme}");
    assert!(ratio >= readme * (1.0 - WORSE), "{what}: {ratio:.3} is better: the page says {readme}");
}

/// The errors of the default model alone.
pub fn by_default(drive: &Drive) -> DriveErrors {
    let mut default = GyroNet::shipped().expect("it comes with the library");
    let networks = Networks { default: &mut default, sent: None, paper: None };
    DriveErrors::of(drive, networks, |_| {}).expect("it stands first, with a reference")
}

#[test]
fn rates_are_as_good_as_the_pages_say() {
    let Some(paths) = recordings::trials(&TRIALS) else { return };
    let drives = parallel::map(&paths, |path| by_default(&Drive::open(path).expect("a recording")));
    let report = Report::new(drives.clone());
    let rows = &report.sets[0].methods;
    let error = |rows: &PerMethod<Row>, method| rows[method].error.mean_1s_rad.expect("whole seconds");
    let to_static = |rows: &PerMethod<Row>, method| error(rows, method) / error(rows, Method::STATIC);
    for (row, method) in ROWS {
        let readme = numbers("tools/MEASUREMENTS.md", row);
        hold(row, to_static(rows, method), readme[1]);
        for ((trial, drive), readme) in TRIALS.iter().zip(&drives).zip(&readme[2..]) {
            let what = format!("trial {trial:02}, {method:?} to static");
            hold(&what, to_static(&drive.methods, method), *readme);
        }
    }
    let ours = report.sets[0].over_best_classical.expect("two drives").default;
    hold(ours.best_classical, ours.ratio, number_before(OVER_BEST_CLASSICAL));
}

/// The unit is calibrated on the training drives; static initialisation is that without it.
#[test]
fn a_calibrated_unit_is_as_good_as_the_page_says() {
    const TRAINING: [u32; 6] = [2, 3, 4, 6, 7, 8];
    let (Some(training), Some(test)) = (recordings::trials(&TRAINING), recordings::trials(&TRIALS)) else {
        return;
    };
    let blob = Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library");
    let cuts = parallel::map(&training, |path| {
        let drive = Drive::open(path).expect("a recording");
        let board = Board::new(config(), drive.wheels(), GyroNet::new(blob));
        Cut::new(&drive, board, || {}).expect("it has a reference")
    });
    let unit = calibrate(&cuts, blob.crc).expect("they turn");
    let errors = parallel::map(&test, |path| {
        let mut drive = Drive::open(path).expect("a recording");
        [None, Some(unit.gyro_map)].map(|map| {
            drive.gyro_map = map;
            let errors = by_default(&drive);
            let error = |method| errors.methods[method].error.mean_1s_rad.expect("whole seconds");
            [Method::STATIC, Method::LIVE, Method::DELAYED].map(error)
        })
    });
    for (at, row) in [(1, "| gyronet, live rate, calibrated |"), (2, "| gyronet, delayed rate, calibrated |")]
    {
        let page = numbers("tools/MEASUREMENTS.md", row);
        let [uncalibrated, calibrated] =
            [(0, 0), (1, at)].map(|(run, method)| errors.iter().map(|drive| drive[run][method]).sum::<f64>());
        hold(row, calibrated / uncalibrated, page[1]);
        for (drive, page) in errors.iter().zip(&page[2..]) {
            hold(row, drive[1][at] / drive[0][0], *page);
        }
    }
}
