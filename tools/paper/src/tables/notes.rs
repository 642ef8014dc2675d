//! Writes the remarks below the tables: the differences from the paper, and the omitted trajectories.

use super::paper;
use super::results::{ByMethod, SequenceErrors};
use gyronet_tools::evaluate::methods::{Gyro, Method};
use std::collections::BTreeSet;

pub const BUNDLED: [&str; 2] = [
    "GyroNet's bundled weights were trained on real drives of another car with another sensor.",
    "FoGNet's bundled weights were trained on simulated sequences of KAIST's layout.",
];

const FOGNET: [&str; 3] = [
    "FoGNet corrects the error that remains after the Earth's rate and the bias. It runs only on the gyro that its weights \
     were trained for; elsewhere its row equals the default's.",
    "Our FoGNet estimates the gyro's error, which is subtracted; the paper's estimates the prediction minus the \
     measurement, which is added.",
    BUNDLED[1],
];

/// Returns `notes` with the remarks on FoGNet, on the fit and on the omitted trajectories added.
pub fn with_fognet(set: &[&SequenceErrors], notes: &[&str]) -> Vec<String> {
    let mut fitted: Vec<String> = set.iter().filter_map(|sequence| sequence.fitted.clone()).collect();
    fitted.dedup();
    let refused = set.iter().filter_map(|s| Some(format!("{}: {}", s.name, s.refused.as_ref()?)));
    let notes = notes.iter().chain(&FOGNET).map(|note| (*note).to_owned());
    notes.chain(fitted).chain(refused).chain(left_out(set)).collect()
}

pub fn orientation(set: &[&SequenceErrors], means: &ByMethod) -> Vec<String> {
    let mut notes: Vec<String> = [
        "The paper's figures are for KAIST Urban. Its errors are against the FoG, ours against the data set's truth.",
        "Unlike the paper's, our GyroNet and our FIR get readings with the mean of static initialisation subtracted.",
        BUNDLED[0],
    ]
    .map(String::from)
    .into();
    let [still, network, looped] = ["static", "gyronet", "gyronet_loop"].map(|key| means.get(key));
    if let (Some(still), Some(network), Some(looped)) = (still, network, looped) {
        notes.push(format!(
            "GyroNet's error in 1 s is {:.3} of that of static initialisation, {:.3} with the bias loop; \
             in the paper {:.3}.",
            network.mean_1s_rad / still.mean_1s_rad,
            looped.mean_1s_rad / still.mean_1s_rad,
            paper::GYRONET_TO_STATIC
        ));
    }
    if set.iter().any(|sequence| !sequence.methods.contains_key(Method::VENDOR.key)) {
        notes.push("VQF replaces the vendor's filter, whose heading these data do not have.".into());
    }
    notes.extend(with_fognet(set, &[]));
    notes
}

pub fn rivals(set: &[&SequenceErrors]) -> Vec<String> {
    let own = paper::average(&paper::RINS_W);
    let (_, printed) = paper::RINS_W_AVERAGE;
    let averages = format!(
        "The paper's averages of RINS-W do not follow from its rows: those give {:.1} and {:.1}, printed are {} and {}.",
        own[0], own[1], printed[0], printed[1]
    );
    let other =
        "The paper's FoGNet is that of its Table II, rounded, except for urban16: 18.08 there, 19 here.";
    let mean = "The paper gives the mean ATE here; ours is the rmse, and the JSON has both.";
    let mut notes = with_fognet(set, &[&averages, other, mean]);
    if !set.iter().flat_map(|sequence| &sequence.order).any(|method| method.gyro == Gyro::Given) {
        notes.push("--method NAME=FOLDER adds other methods; python -m gyronet_train.rinsw and .lwoi train the paper's rivals."
                .into());
    }
    notes
}

/// Returns for each given method on how many sequences it was left out, and the reasons.
fn left_out(set: &[&SequenceErrors]) -> Vec<String> {
    let methods: BTreeSet<&str> = set.iter().flat_map(|s| s.left_out.keys().copied()).collect();
    let mut notes = Vec::new();
    for method in methods {
        let reasons: Vec<&String> = set.iter().filter_map(|s| s.left_out.get(method)).collect();
        notes.push(format!("{method}: {} of {} sequences left out", reasons.len(), set.len()));
        notes.extend(reasons.into_iter().map(|why| format!("  {why}")));
    }
    notes
}
