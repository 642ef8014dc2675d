//! Long runs of the situations: each in all of its vehicles, with many seeds.

use clap::Parser;
use gyronet_host_tests::parallel;
use gyronet_host_tests::situations::judge::{HEADING, Outcome};
use gyronet_host_tests::situations::{list, recordings};
use std::path::PathBuf;
use std::process::ExitCode;

/// Drive vehicles through the situations, and hold what the bus says against the truth.
///
/// The exit status is 1 if a promise is broken in any of them.
#[derive(Parser)]
struct Args {
    /// Situations whose names contain this; all without it.
    #[arg(value_name = "NAME", default_value = "")]
    name: String,
    /// Only vehicles of this name.
    #[arg(long)]
    vehicle: Option<String>,
    /// Seeds of each vehicle in each situation.
    #[arg(long, default_value_t = 10)]
    seeds: u64,
    /// Judge the recordings of this folder instead, by their references.
    #[arg(long, value_name = "FOLDER")]
    recordings: Option<PathBuf>,
    /// The first seed.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

fn main() -> ExitCode {
    let args = Args::parse();
    let threads: Vec<u64> = (0..std::thread::available_parallelism().map_or(1, usize::from) as u64).collect();
    let (mut is_broken, mut good, mut wrong) = (false, 0, 0);
    println!("{HEADING}");
    for (name, outcome) in args.recordings.iter().flat_map(|folder| recordings::judged(folder, &args.name)) {
        print!("{}", outcome.line(&name, ""));
        is_broken |= !outcome.broken().is_empty();
    }
    let is_simulated = args.recordings.is_none();
    for situation in
        list::all().filter(|_| is_simulated).filter(|situation| situation.name.contains(&args.name))
    {
        for vehicle in situation.vehicles {
            if args.vehicle.as_ref().is_some_and(|name| name != vehicle.name) {
                continue;
            }
            let outcomes = parallel::map(&threads, |first| {
                let mut outcome = Outcome::default();
                for seed in (args.seed..args.seed + args.seeds).skip(*first as usize).step_by(threads.len()) {
                    outcome.add(&situation.run(vehicle, seed));
                }
                outcome
            });
            let mut outcome = Outcome::default();
            outcomes.iter().filter(|one| one.seconds > 0).for_each(|one| outcome.add(one));
            print!("{}", outcome.line(situation.name, vehicle.name));
            is_broken |= !outcome.broken().is_empty();
            (good, wrong) = (good + outcome.good, wrong + outcome.second.wrong);
        }
    }
    if is_simulated {
        println!("{wrong} of {good} good seconds were off by more than four of their expected errors");
    }
    ExitCode::from(u8::from(is_broken))
}
