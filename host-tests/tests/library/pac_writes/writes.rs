//! Finds the whole writes of registers in a source file and complains of those that do not
//! say which reset value they begin with.

use super::reset_values::{ResetValues, hexadecimal};
use std::collections::BTreeSet;
use syn::visit::{self, Visit};
use syn::{Expr, ExprMethodCall, Ident, Macro};

/// A comment with this marker and the value explains a write that does not begin at zero.
const MARKER: &str = "// reset value:";

/// The result for one file.
pub struct Found {
    /// The number of whole writes of registers.
    pub writes: usize,
    /// Each complaint begins with the line of its write.
    pub complaints: Vec<String>,
}

/// Finds the writes of a file's text that are not explained.
pub fn unexplained(text: &str, values: &ResetValues) -> Result<Found, String> {
    let file = syn::parse_file(text).map_err(|error| format!("{}: {error}", error.span().start().line))?;
    let mut visitor = Visitor { values, writes: Vec::new(), peripherals: BTreeSet::new() };
    visitor.visit_file(&file);
    let Visitor { writes, peripherals, .. } = visitor;
    let lines: Vec<&str> = text.lines().collect();
    let complaints =
        writes.iter().filter_map(|write| write.complaint(&lines, &peripherals, values)).collect();
    Ok(Found { writes: writes.len(), complaints })
}

/// A whole write of a register.
struct Write {
    /// The lines of the accessor and of `write`.
    lines: [usize; 2],
    register: Register,
}

enum Register {
    /// The accessor names it.
    Accessor(String),
    /// A variable holds it: `let mcr = can.mcr(); mcr.write(...)`. Such a name is not followed.
    Name,
    /// It is written in the argument of a macro, which is not parsed.
    Macro,
}

impl Write {
    fn complaint(
        &self,
        lines: &[&str],
        peripherals: &BTreeSet<String>,
        values: &ResetValues,
    ) -> Option<String> {
        let [line, last] = self.lines;
        let accessor = match &self.register {
            Register::Accessor(accessor) => accessor,
            Register::Name => {
                return Some(format!("{line}: a register behind a name: its reset value is not looked up"));
            }
            Register::Macro => {
                return Some(format!("{line}: a write inside a macro: its reset value is not looked up"));
            }
        };
        // Any peripheral is meant if none of those that the file names has such a register.
        let of = |peripheral: &str| Some((peripheral.to_owned(), values.of(peripheral, accessor)?));
        let mut meant: Vec<_> = peripherals.iter().filter_map(|name| of(name)).collect();
        if meant.is_empty() {
            meant = values.instances().filter_map(of).collect();
        }
        if meant.is_empty() {
            return Some(format!("{line}: {accessor} is no register of the part"));
        }
        let (peripheral, value) = meant.iter().find(|(_, value)| *value != 0)?;
        let said =
            (line.saturating_sub(1)..=last).filter_map(|line| marked(lines.get(line.checked_sub(1)?)?));
        if said.into_iter().any(|said| meant.iter().any(|(_, value)| *value == said)) {
            return None;
        }
        let value = format!("{:#06x}_{:04x}", value >> 16, value & 0xFFFF);
        Some(format!(
            "{line}: {accessor} of {peripheral} resets to {value}, which this write begins with: no comment \
             `{MARKER} {value}` here or above"
        ))
    }
}

/// Returns the value that a line's comment gives.
fn marked(line: &str) -> Option<u64> {
    let (_, said) = line.split_once(MARKER)?;
    hexadecimal(
        said.trim_start().split(|letter: char| letter != '_' && !letter.is_ascii_alphanumeric()).next()?,
    )
}

struct Visitor<'a> {
    values: &'a ResetValues,
    writes: Vec<Write>,
    /// The instances and modules of the part that the file names.
    peripherals: BTreeSet<String>,
}

impl<'ast> Visit<'ast> for Visitor<'_> {
    fn visit_expr_method_call(&mut self, call: &'ast ExprMethodCall) {
        visit::visit_expr_method_call(self, call);
        // The crate's `write` takes a closure; those of lines and slots do not.
        if call.method != "write" || !matches!(call.args.first(), Some(Expr::Closure(_))) {
            return;
        }
        let last = call.method.span().start().line;
        let (line, register) = match &*call.receiver {
            Expr::MethodCall(accessor) => {
                (accessor.method.span().start().line, Register::Accessor(accessor.method.to_string()))
            }
            _ => (last, Register::Name),
        };
        self.writes.push(Write { lines: [line, last], register });
    }

    fn visit_macro(&mut self, content: &'ast Macro) {
        visit::visit_macro(self, content);
        let text: String = content.tokens.to_string().split_whitespace().collect();
        if text.contains(".write(|") {
            let line = content.path.segments.first().map_or(0, |name| name.ident.span().start().line);
            self.writes.push(Write { lines: [line, line], register: Register::Macro });
        }
    }

    /// An instance's name (`CAN1`) counts wherever it stands; a module's (`can1`) may be a variable's.
    fn visit_ident(&mut self, name: &'ast Ident) {
        let name = name.to_string();
        if name.chars().all(|letter| !letter.is_ascii_lowercase()) && self.values.knows(&name) {
            self.peripherals.insert(name);
        }
    }

    fn visit_use_path(&mut self, path: &'ast syn::UsePath) {
        visit::visit_use_path(self, path);
        self.peripherals.extend(Some(path.ident.to_string()).filter(|name| self.values.knows(name)));
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        visit::visit_path(self, path);
        if path.segments.len() > 1 {
            let names = path.segments.iter().map(|segment| segment.ident.to_string());
            self.peripherals.extend(names.filter(|name| self.values.knows(name)));
        }
    }
}
