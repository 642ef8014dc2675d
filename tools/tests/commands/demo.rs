//! The command `gyronet demo`: its page, its JSON, its log.

use super::{gyronet, scratch, text};
use gyronet_tools::bundled;
use gyronet_tools::drive::track::Track;
use std::path::{Path, PathBuf};

fn demo(name: &str, arguments: &[&str]) -> (PathBuf, String) {
    let folder = scratch(name);
    let output = gyronet(&[&["demo", "--out", folder.to_str().unwrap()], arguments].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    (folder, text(&output.stdout))
}

#[test]
fn the_page_needs_nothing_else_and_says_what_the_json_says() {
    let drive = concat!(env!("CARGO_MANIFEST_DIR"), "/data/simulated_drive.csv");
    let (folder, json) = demo("demo-page", &[drive, "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let page = std::fs::read_to_string(folder.join("demo.html")).unwrap();
    for outside in ["http://", "https://", "src=", "href=", "@import", "url("] {
        assert!(!page.contains(outside), "{outside}");
    }
    for section in ["Yaw", "Path", "Methods"] {
        assert!(page.contains(&format!("<h2>{section}</h2>")), "{section}");
    }
    assert!(!page.contains("Simulated drive."), "it is a file like any other");
    assert_eq!(page.matches("<svg").count(), 6);
    // Five methods and the reference, five errors, three paths and the reference; bias, roll and pitch, each with its bounds.
    assert_eq!(page.matches("<polyline").count(), 24);
    let ours = &json["methods"]["default"];
    for (figure, decimals) in [("mean_1s_rad", 4), ("final_rad", 3)] {
        let figure = ours[figure].as_f64().unwrap().to_degrees();
        assert!(page.contains(&format!("<td>{figure:.decimals$} </td>")), "{figure}");
    }
    let log = std::fs::read_to_string(folder.join("can.log")).unwrap();
    assert_eq!(json["frames"], log.lines().count());
}

#[test]
fn the_readme_has_the_tables_that_the_demo_prints() {
    let (folder, text) = demo("demo-text", &[]);
    let page = std::fs::read_to_string(folder.join("demo.html")).unwrap();
    assert!(text.starts_with("A SIMULATED drive") && page.contains("Simulated drive."));
    let readme = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../README.md")).unwrap();
    let table = text.split("\n\n").find(|part| part.starts_with("  heading error")).expect("a table");
    assert!(readme.contains(table), "{table}");
    assert!(page.contains("<h2>A tunnel</h2>") && page.contains(">the median of 44 "));
    assert!(page.contains("<h2>What the board learns</h2>") && page.contains("<b>Pitch of the mounting</b>"));
    let tunnels = text.split("\n\n").find(|part| part.starts_with("60 s without")).expect("a table");
    let ours = tunnels.lines().last().expect("a row").split_whitespace();
    let cells: String = ours.map(|cell| format!("<td>{cell}</td>")).collect();
    assert!(page.contains(&cells) && readme.contains(tunnels), "{tunnels}");
}

#[test]
fn a_drive_without_reference_and_wheels_has_no_errors_and_no_path() {
    let mut csv = String::from("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z\n");
    for k in 0..600 {
        // Every axis flickers as a sensor does; equal readings are stuck ones.
        let noise = 1e-3 * f64::from(k % 3 - 1);
        let (time, up, yaw_rate) = (0.01 * f64::from(k), 9.8 + 10.0 * noise, 0.001 + noise);
        csv += &format!("{time:.2},{noise},{noise},{up},{noise},{noise},{yaw_rate}\n");
    }
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bare <drive>.csv");
    std::fs::write(&file, csv).unwrap();
    let (folder, text) = demo("demo-bare", &[file.to_str().unwrap()]);
    assert!(
        text.contains("bare <drive>, 6 s\n\nNo reference (ref_gyr_z or ref_yaw), so no errors."),
        "{text}"
    );
    assert!(!text.contains('\u{1b}'), "no colours without a terminal");
    let page = std::fs::read_to_string(folder.join("demo.html")).unwrap();
    assert!(page.contains("<h1>bare &lt;drive&gt;</h1>") && !page.contains("<h2>Path</h2>"));
    assert_eq!(page.matches("<svg").count(), 4);
}

#[test]
fn a_drive_with_gnss_shows_its_course_its_track_and_its_errors() {
    let mut csv =
        String::from("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,ref_yaw,gnss_speed,gnss_lat,gnss_lon\n");
    let mut track = Track::default();
    for (k, line) in bundled::SIMULATED_DRIVE.lines().skip(1).enumerate() {
        let fields: Vec<&str> = line.split(',').collect();
        let [rate, wheel] = [9, 11].map(|at| fields[at].parse::<f64>().unwrap());
        track.step([0.00289 * wheel; 2], 0.01 * rate);
        let [north, west] = track.position.map(|metres| metres / 111_132.0);
        let fix = format!("{},{},{north:.8},{:.8}", track.yaw, 0.289 * wheel, -west);
        csv += &format!("{},{}\n", fields[..7].join(","), if k % 100 == 0 { &fix } else { ",,," });
    }
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("gnss.csv");
    std::fs::write(&file, csv).unwrap();
    let (folder, json) = demo("demo-gnss", &[file.to_str().unwrap(), "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let off = json["paths"].as_array().unwrap().iter().find(|path| path["method"] == "default").unwrap();
    assert!(off["error_m"].as_f64().is_some_and(|metres| metres < 2.0), "{off}");
    let page = std::fs::read_to_string(folder.join("demo.html")).unwrap();
    assert!(page.contains(">course by GNSS ") && page.contains(">GNSS receiver "));
    // Five methods and the course, five errors, three paths, the reference and the receiver; what is learnt, with gain.
    assert_eq!(
        page.matches("<polyline class=").count() - page.matches("<polyline class=\"curve").count(),
        28
    );
}
