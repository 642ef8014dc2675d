//! The pages of `gyronet demo` and `gyronet doctor` in a real browser: no errors, nothing asked of the network, nothing cut
//! or beside the window on a desk and on a phone, light and dark, and all that can be used can be used from the keyboard.

use gyronet::model::{Blob, GyroNet, weights};
use gyronet_host_tests::browser::Browser;
use gyronet_host_tests::recordings::{trial, workspace};
use gyronet_tools::demo::{Demo, Sent};
use gyronet_tools::doctor::{Doctor, page};
use gyronet_tools::drive::recording::Recording;
use gyronet_tools::drive::stream::Drive;
use gyronet_tools::evaluate::rates::{Network, Networks, Rates};
use gyronet_tools::evaluate::report::DriveErrors;
use std::path::{Path, PathBuf};

/// Texts that reach beyond the window, or beyond what scrolls inside the page.
const CUT: &str = r"[...document.querySelectorAll('h1,h2,p,dt,dd,td,th,button,figcaption,.plot b')].filter(e => {
    const box = e.getBoundingClientRect();
    return box.width && !e.closest('.scroll') && (box.left < 0 || box.right > WIDTH + 0.5);
}).map(e => e.textContent)";
/// Neighbours that lie over each other: numbers of an axis, names of a legend, and what follows a chart.
const OVER: &str = r"['.plot .x b', '.plot .y b', '.legend .key', 'h2, figcaption, p.note, .plot .x b, td'].flatMap(kind => {
    const all = [...document.querySelectorAll(kind)].map(e => [e, e.getBoundingClientRect()]).filter(([, box]) => box.width);
    return all.slice(1).flatMap(([e, b], k) => {
        const [before, a] = all[k];
        const apart = a.right <= b.left || b.right <= a.left || a.bottom <= b.top + 1 || b.bottom <= a.top + 1;
        return apart ? [] : [before.textContent + ' / ' + e.textContent];
    });
})";
/// This script lists the controls that are shown.
const USABLE: &str = "[...document.querySelectorAll('button, .plot')].filter(e => e.offsetParent)";

/// Returns the page of `gyronet demo` on a drive.
fn demo(recording: &Recording) -> String {
    let network = || GyroNet::new(Blob::new_checked(&weights::DEFAULT.0).unwrap());
    let (drive, mut default) = (Drive::from(recording), network());
    let shape = default.blob().shape;
    let mut networks = Networks { default: Network::new(&mut default, shape), sent: None, paper: None };
    let mut rates = Rates::of(&drive);
    let errors = DriveErrors::of(&drive, &mut networks, |sample| rates.add(sample)).unwrap();
    let sent = Sent::run(&drive, network(), std::io::sink()).unwrap();
    Demo::new(&drive, true, &rates, Some(&errors), &sent).page()
}

fn doctor(path: &Path) -> String {
    page(&Doctor::examine(path).unwrap())
}

/// Opens a page and returns what is wrong with it.
fn faults(browser: &mut Browser, path: &Path, width: u32, dark: bool) -> Vec<String> {
    browser.open(path, width, dark);
    let (complaints, requests) = browser.complaints_and_requests();
    let mut faults: Vec<String> =
        complaints.iter().map(|complaint| format!("console: {complaint}")).collect();
    let own = format!("file://{}", path.display());
    faults.extend(requests.iter().filter(|url| **url != own).map(|url| format!("asks for {url}")));
    let needed = browser.evaluate("document.documentElement.scrollWidth");
    if needed.as_u64() > Some(width.into()) {
        faults.push(format!("wide: {needed} px"));
    }
    for (what, expression) in [("cut", CUT), ("over each other", OVER)] {
        let texts = browser.evaluate(&expression.replace("WIDTH", &width.to_string()));
        faults.extend(texts.as_array().unwrap().iter().map(|text| format!("{what}: {text}")));
    }
    let paper = browser.evaluate("getComputedStyle(document.body).backgroundColor");
    if (paper == "rgb(255, 255, 255)") == dark {
        faults.push(format!("paper: {paper}"));
    }
    faults
}

/// Goes through a page with the Tab key, and returns how often what had the focus did not show it, and how much was never
/// reached.
fn tab_through(browser: &mut Browser) -> (usize, u64) {
    let usable = browser.evaluate(&format!("{USABLE}.length")).as_u64().unwrap();
    let mut unseen = 0;
    for _ in 0..usable {
        browser.press("Tab");
        let outline =
            "(e => (e.dataset.reached = 1, getComputedStyle(e).outlineStyle))(document.activeElement)";
        unseen += usize::from(browser.evaluate(outline) != "solid");
    }
    let missed = browser.evaluate(&format!("{USABLE}.filter(e => !e.dataset.reached).length"));
    (unseen, missed.as_u64().unwrap())
}

/// Hides a curve and zooms into a chart, by keys alone.
fn assert_keys_work(browser: &mut Browser) {
    browser.evaluate("document.querySelector('.key').focus()");
    let hidden = "document.querySelectorAll('polyline.hidden').length";
    assert_eq!(browser.evaluate(hidden), 0);
    browser.press("Enter");
    assert_eq!(browser.evaluate(hidden), 1);

    browser.evaluate("document.querySelector('.plot').focus()");
    let view = "document.querySelector('.plot svg').getAttribute('viewBox')";
    browser.press("+");
    assert!(browser.evaluate(view).as_str().unwrap().starts_with("2500 "), "{}", browser.evaluate(view));
    browser.press("Escape");
    assert_eq!(browser.evaluate(view), "0 0 10000 10000");
}

fn browser(test: &str) -> Option<(Browser, PathBuf)> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    std::fs::create_dir_all(&folder).unwrap();
    Some((Browser::start(test, &folder.join("profile"))?, folder))
}

#[test]
fn pages_work_in_a_browser_on_desk_and_phone() {
    let test = "pages_work_in_a_browser_on_desk_and_phone";
    let Some((mut browser, folder)) = browser(test) else { return };
    let simulated = workspace().join("tools/data/simulated_drive.csv");
    for drive in [simulated].into_iter().chain(trial(test, 11)) {
        let recording = Recording::read(&drive).unwrap();
        for (name, html) in [("demo", demo(&recording)), ("doctor", doctor(&drive))] {
            let path = folder.join(format!("{name}-{}.html", recording.name()));
            std::fs::write(&path, html).unwrap();
            for (width, dark) in [(390, false), (390, true), (1280, false), (1280, true)] {
                let faults = faults(&mut browser, &path, width, dark);
                assert!(faults.is_empty(), "{}, {width} px, dark: {dark}: {faults:#?}", path.display());
            }
            assert_eq!(tab_through(&mut browser), (0, 0), "{}", path.display());
            assert_keys_work(&mut browser);
        }
    }
}

#[test]
fn the_faults_of_a_page_are_seen() {
    let Some((mut browser, folder)) = browser("the_faults_of_a_page_are_seen") else { return };
    let path = folder.join("bad.html");
    let html = "<!doctype html><meta name='viewport' content='width=device-width'><style>:focus-visible { outline: none } body { margin: 0; background: #fff }</style>\
                <div style='width: 800px'>wide</div><button style='margin-left: 380px'>cut name</button>\
                <h2>one</h2><h2 style='margin-top: -3rem'>two</h2><button tabindex=-1>never</button>\
                <img src='other.png'><script>console.log('a remark'); nothing.here()</script>";
    std::fs::write(&path, html).unwrap();
    let faults = faults(&mut browser, &path, 390, true);
    for fault in [
        "console: ",
        "asks for file://",
        "wide: ",
        "cut: \"cut name\"",
        "over each other: \"one / two\"",
        "paper: ",
    ] {
        assert!(faults.iter().any(|found| found.starts_with(fault)), "{fault} is not among {faults:#?}");
    }
    assert!(faults.iter().any(|fault| fault.contains("a remark")), "{faults:#?}");
    assert!(faults.iter().any(|fault| fault.contains("nothing is not defined")), "{faults:#?}");
    assert_eq!(tab_through(&mut browser), (2, 1));
}
