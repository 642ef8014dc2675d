//! Passes folders in the layouts of KAIST Urban and NCLT to the loaders.

use super::Seed;
use gyronet_paper::sequence::{Sequence, write_csv};
use std::cell::RefCell;
use std::path::Path;
use std::{fs, io};
use tempfile::{TempDir, tempdir};

const KAIST: [&str; 5] = [
    "sensor_data/xsens_imu.csv",
    "sensor_data/fog.csv",
    "sensor_data/encoder.csv",
    "global_pose.csv",
    "calibration/EncoderParameter.txt",
];
const NCLT: [&str; 4] = ["ms25.csv", "kvh.csv", "wheels.csv", "groundtruth_2012-01-08.csv"];

/// A folder for each thread; only changed files are written again.
struct Folder {
    root: TempDir,
    files: Vec<Vec<u8>>,
}

impl Folder {
    fn new(name: &str, files: usize) -> Self {
        let root = tempdir().expect("a temporary folder");
        for sub in ["sensor_data", "calibration"].iter().take(if name == "kaist" { 2 } else { 0 }) {
            fs::create_dir_all(root.path().join(sub)).expect("a temporary folder");
        }
        Self { root, files: vec![vec![0]; files] }
    }

    fn write(&mut self, names: &[&str], content: &[&[u8]]) -> io::Result<()> {
        for ((name, content), written) in names.iter().zip(content).zip(&mut self.files) {
            if written != content {
                fs::write(self.root.path().join(name), content)?;
                *written = content.to_vec();
            }
        }
        Ok(())
    }
}

thread_local! {
    static FOLDERS: RefCell<[Folder; 2]> =
        RefCell::new([Folder::new("kaist", KAIST.len()), Folder::new("nclt", NCLT.len())]);
}

/// Reads a folder. The first byte selects the layout; the files follow, separated by zeros. Values that are read must
/// be finite and writable as CSV; an error must name a file of the folder.
pub fn folder(data: &[u8]) {
    let Some((layout, data)) = data.split_first() else { return };
    let layout = usize::from(layout & 1);
    let names: &[&str] = [&KAIST[..], &NCLT][layout];
    let mut content: Vec<&[u8]> = data.splitn(names.len(), |byte| *byte == 0).collect();
    content.resize(names.len(), b"");
    FOLDERS.with_borrow_mut(|folders| {
        let folder = &mut folders[layout];
        folder.write(names, &content).expect("a temporary folder");
        check(folder.root.path());
    });
}

fn check(folder: &Path) {
    match Sequence::read(folder) {
        Ok(sequence) => {
            let finite = sequence.steps.iter().all(|step| {
                let singles = step.specific_force.iter().chain(&step.angular_rate);
                let doubles = step.wheels.iter().chain(&step.position);
                let angles = [step.fog, step.yaw, step.vendor_yaw];
                singles.copied().all(f32::is_finite) && doubles.copied().chain(angles).all(f64::is_finite)
            });
            assert!(finite, "a value is not a number");
            write_csv(&sequence, io::sink()).expect("a sink accepts everything");
            let _ = sequence.recording();
        }
        Err(error) => assert!(error.to_string().starts_with(&folder.display().to_string()), "{error}"),
    }
}

pub fn seeds() -> Vec<Seed> {
    let nano = |k: u64| 1_500_000_000_000_000_000 + k * 3_000_000_000;
    let micro = |k: u64| 1_330_000_000_000_000 + k * 3_000_000;
    let rows = |row: &dyn Fn(u64) -> String| (0..3).map(row).collect::<String>();
    let join = |layout: u8, files: &[String]| [&[layout][..], files.join("\0").as_bytes()].concat();
    let whole = |k| format!("{},0,0,0,1,0,0,0,0,0,.1,0,0,9.8,0,0,0\n", nano(k));
    let orientation = |k| format!("{},0,0,.1,1,0,0,0\n", nano(k));
    let kaist =
        |imu: String| {
            let pose = |k| format!("{},1,0,0,300000,0,1,0,4000000,0,0,1,5\n", nano(k));
            join(0, &[
            imu,
            rows(&|k| format!("{},0,0,1e-4\n", nano(k))),
            rows(&|k| format!("{},{},{}\n", nano(k), 400 * k, 401 * k)),
            rows(&pose),
            "Encoder calibrated parameter\nEncoder resolution: 4096\nEncoder left wheel diameter: 0.62\n\
             Encoder right wheel diameter: 0.62\nEncoder wheel base: 1.5\n"
                .to_owned(),
        ])
        };
    let nclt = join(
        1,
        &[
            rows(&|k| format!("{},0,0,0,0,0,9.8,0,0,.1\n", micro(k))),
            rows(&|k| format!("{},{}\n", micro(k), 0.1 * k as f64)),
            rows(&|k| format!("{},1,1\n", micro(k))),
            rows(&|k| format!("{},{k},0,0,0,0,3.1\n", micro(k))),
        ],
    );
    vec![("kaist", kaist(rows(&whole))), ("kaist_early", kaist(rows(&orientation))), ("nclt", nclt)]
}
