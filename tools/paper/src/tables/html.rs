//! Writes one self-contained HTML page with all tables and charts.

use super::table::{Row, Table};
use gyronet_tools::plot::page::{self, HINT, document, escaped};
use std::fmt::Write;

pub fn page(tables: &[Table], charts: &[(String, Vec<String>)]) -> String {
    let mut html = String::from("<h1>The paper's tables</h1>\n");
    html += "<p class=\"lead\">X. Zhao et al., <i>Learning to Compensate for the Drift and Error of Gyroscope in \
             Vehicle Localization</i>; written by <code>gyronet-paper tables</code>.</p>\n";
    for table in tables {
        let simulated = if table.simulated { " <span class=\"simulated\">simulated</span>" } else { "" };
        // Writing to a string cannot fail.
        let _ = writeln!(html, "<h2>{}{simulated}</h2>", escaped(&table.title));
        let ours = if table.simulated { "here, simulated" } else { "here" };
        html += &block(ours, &table.columns, &table.rows, table.decimals);
        html += &block("in the paper", &table.paper_columns, &table.paper_rows, table.decimals);
        for note in &table.notes {
            let _ = writeln!(html, "<p class=\"note\">{}</p>", escaped(note));
        }
    }
    if !charts.is_empty() {
        let _ = writeln!(html, "<p class=\"note\">{HINT}</p>");
    }
    for (k, (name, charts)) in charts.iter().enumerate() {
        let open = if k == 0 { " open" } else { "" };
        let charts = charts.concat();
        let _ = writeln!(html, "<details{open}><summary>{}</summary>\n{charts}</details>", escaped(name));
    }
    document("gyronet: the paper's tables", &html)
}

fn block(caption: &str, columns: &[String], rows: &[Row], decimals: usize) -> String {
    let header: Vec<&str> = [""].into_iter().chain(columns.iter().map(String::as_str)).collect();
    let figure = |figure: &Option<f64>| figure.map_or("-".into(), |figure| format!("{figure:.decimals$}"));
    let cells = |row: &Row| [row.name.clone()].into_iter().chain(row.figures.iter().map(figure)).collect();
    page::table("figures", caption, &header, rows.iter().map(cells).collect::<Vec<Vec<String>>>())
}
