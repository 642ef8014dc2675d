//! Each situation once: the promises that are broken are those known to be.

mod judge;

use gyronet_host_tests::parallel;
use gyronet_host_tests::situations::known;
use gyronet_host_tests::situations::list::{self, Situation};
use gyronet_host_tests::situations::report::{HEADING, line};

#[test]
fn no_situation_is_wrong_and_good() {
    let situations: Vec<&Situation> = list::all().collect();
    parallel::table(HEADING, &situations, |situation| {
        let vehicle = &situation.vehicles[0];
        let outcome = situation.run(vehicle, 1);
        let (broken, known) = (letters(&outcome.broken()), known::letters(situation.name));
        let failed =
            (broken != known).then(|| format!("{}: {broken:?} broken, {known:?} known", situation.name));
        (line(situation, vehicle.name, &outcome), Vec::from_iter(failed))
    });
}

fn letters(broken: &[(char, String)]) -> String {
    broken.iter().map(|(letter, _)| letter).collect()
}
