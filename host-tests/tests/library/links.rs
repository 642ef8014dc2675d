//! Every link inside the repository's pages leads to a file and, where it names one, to a heading; every test that a page
//! names exists.

use gyronet_host_tests::recordings::workspace;
use std::fs;
use std::path::PathBuf;

#[test]
fn no_link_is_dead() {
    let mut seen = 0;
    for path in pages() {
        let page = path.display();
        for link in links(&fs::read_to_string(&path).unwrap()) {
            if link.starts_with("http") {
                continue;
            }
            let (file, heading) = link.split_once('#').unwrap_or((&link, ""));
            let target = if file.is_empty() { path.clone() } else { path.with_file_name("").join(file) };
            assert!(target.exists(), "{page}: {link} leads nowhere");
            assert!(heading.is_empty() || headings(&target).iter().any(|h| h == heading), "{page}: {link}");
            seen += 1;
        }
    }
    assert!(seen > 10, "{seen} links found in all pages: are they read at all?");
}

/// Criterion: a page names a test as `binary::module::test` in backticks, and that module's file has such a function.
#[test]
fn tests_that_pages_name_exist() {
    let root = workspace();
    let mut seen = 0;
    for path in pages() {
        let page = path.display();
        let text = fs::read_to_string(&path).unwrap();
        for name in text.split('`').skip(1).step_by(2) {
            let parts: Vec<&str> = name.split("::").collect();
            let [binary @ ("board" | "image" | "library" | "tools" | "faults"), modules @ .., test] =
                &parts[..]
            else {
                continue;
            };
            let module = root.join("host-tests/tests").join(binary).join(modules.join("/"));
            let file = fs::read_to_string(module.with_extension("rs"));
            // A name may be that of a whole module.
            let whole = module.join(test).with_extension("rs").exists();
            let has = |text: String| text.contains(&format!("fn {test}("));
            assert!(whole || file.is_ok_and(has), "{page}: no test {name}");
            seen += 1;
        }
    }
    assert!(seen > 5, "{seen} names found in all pages: are they read at all?");
}

/// The repository's pages: every `.md` file, without what is built or downloaded.
fn pages() -> Vec<PathBuf> {
    let mut folders = vec![workspace().to_owned()];
    let mut pages = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            if path.is_dir() && !name.starts_with('.') && name != "target" {
                folders.push(path);
            } else if name.ends_with(".md") {
                pages.push(path);
            }
        }
    }
    pages
}

fn links(text: &str) -> Vec<String> {
    text.split("](")
        .skip(1)
        .filter_map(|rest| rest.split_once(')'))
        .map(|(link, _)| link.to_owned())
        .collect()
}

/// The headings of a page, as a browser of repositories makes anchors of them.
fn headings(page: &PathBuf) -> Vec<String> {
    let text = fs::read_to_string(page).unwrap();
    text.lines()
        .filter(|line| line.starts_with('#'))
        .map(|line| {
            let title = line.trim_start_matches('#').trim().to_lowercase();
            title
                .chars()
                .filter(|c| c.is_alphanumeric() || " -_".contains(*c))
                .collect::<String>()
                .replace(' ', "-")
        })
        .collect()
}
