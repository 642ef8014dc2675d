//! Prints tables as text.

use super::table::{Row, Table};
use std::fmt;

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let simulated = if self.simulated { " (simulated)" } else { "" };
        writeln!(f, "{}{simulated}", self.title)?;
        block(f, "here", &self.columns, &self.rows, self.decimals)?;
        block(f, "in the paper", &self.paper_columns, &self.paper_rows, self.decimals)?;
        self.notes.iter().try_for_each(|note| writeln!(f, "  {note}"))
    }
}

fn block(
    f: &mut fmt::Formatter<'_>,
    head: &str,
    columns: &[String],
    rows: &[Row],
    decimals: usize,
) -> fmt::Result {
    let first = rows.iter().map(|row| row.name.len()).chain([head.len()]).max().unwrap_or(0);
    let widths: Vec<usize> = columns.iter().map(|column| column.len().max(9) + 2).collect();
    write!(f, "  {head:<first$}")?;
    for (column, width) in columns.iter().zip(&widths) {
        write!(f, "{column:>width$}")?;
    }
    writeln!(f)?;
    for Row { name, figures } in rows {
        write!(f, "  {name:<first$}")?;
        for (figure, width) in figures.iter().zip(&widths) {
            match figure {
                Some(figure) => write!(f, "{figure:>width$.decimals$}")?,
                None => write!(f, "{:>width$}", "-")?,
            }
        }
        writeln!(f)?;
    }
    Ok(())
}
