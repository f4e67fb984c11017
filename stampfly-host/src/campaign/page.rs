//! A fault campaign as one HTML page: fault × moment, pairs of faults, failures with the line that repeats each.
//!
//! A single file without scripts and without any reference to the outside.

use super::summary::{Cell, Failure, Summary, Table, phases};
use crate::page::{self, Metric, escape};
use stampfly_sim::fault::{FaultKind, Moment};
use std::collections::BTreeSet;
use std::fmt::Write;

/// The page of a campaign. `title` is its heading, `subtitle` says what was flown.
#[must_use]
pub fn html(summary: &Summary, faults: &[FaultKind], title: &str, subtitle: &str) -> String {
    let all = &summary.all;
    let judged = |name: &str, count: usize, good: bool| Metric::new(name, count, "").judged(good);
    let metrics = [
        Metric::new("flights", all.flights, ""),
        judged("passed", all.passed(), all.failed == 0),
        judged("wrong end", all.wrong, all.wrong == 0),
        judged("invariant violated", all.violated, all.violated == 0),
        judged("needless cut", all.needless, all.needless == 0),
        Metric::new("fault changed nothing", all.idle, ""),
    ];
    let names: Vec<&str> = faults.iter().map(|kind| kind.name).collect();
    let columns: Vec<&str> = phases().filter(|phase| *phase != "time" || has_column(&summary.cells, phase)).collect();
    let legend = "<p>The worst end of each cell, and its flights; red: how many of them failed; grey: the fault changed nothing.</p>\n";
    let cells = table(&summary.cells, &names, &columns);
    let mut body = section("How often, with 95 % confidence", &rates(summary));
    body += &section("Faults by the moment at which they begin", &format!("{legend}{cells}"));
    if !summary.pairs.is_empty() {
        let others: BTreeSet<&str> = summary.pairs.keys().map(|(_, other)| other.as_str()).collect();
        let others: Vec<&str> = names.iter().copied().filter(|name| others.contains(name)).collect();
        body += &section("Two faults", &table(&summary.pairs, &names, &others));
    }
    if !summary.failures.is_empty() {
        body += &section("Failures", &failures(&summary.failures));
    }
    page::html(title, subtitle, &metrics, include_str!("page.css"), &body)
}

fn has_column(table: &Table, column: &str) -> bool {
    table.keys().any(|(_, name)| name == column)
}

/// Rates of flights with and without a fault, and of cuts.
fn rates(summary: &Summary) -> String {
    let mut text = "<div class=\"scroll\"><table class=\"list\">\n<thead><tr><th></th><th>flights</th><th>failed</th><th>wrong end</th>\
                    <th>invariant violated</th></tr></thead>\n<tbody>\n"
        .to_owned();
    for (name, cell) in [("with a fault", &summary.faulted), ("without a fault", &summary.nominal)] {
        let _ = write!(text, "<tr><th scope=\"row\">{name}</th><td>{}</td>", cell.told());
        text.extend(cell.rates().iter().map(|(_, rate)| format!("<td>{rate}</td>")));
        text += "</tr>\n";
    }
    text += "</tbody>\n</table></div>\n";
    if !summary.cuts.is_empty() {
        text += "<div class=\"scroll\"><table class=\"list\">\n<thead><tr><th>motors stopped in the air by</th><th>flights</th>\
                 <th>rightly</th><th>needlessly: flown on, the flight ends acceptably</th></tr></thead>\n<tbody>\n";
        for (name, cell) in &summary.cuts {
            let (right, rate) = (cell.cuts - cell.needless, cell.needless_cuts());
            let _ = writeln!(
                text,
                "<tr><th scope=\"row\">{}</th><td>{}</td><td>{right}</td><td>{}: {rate}</td></tr>",
                escape(name),
                cell.cuts,
                cell.needless
            );
        }
        text += "</tbody>\n</table></div>\n";
    }
    text
}

fn section(title: &str, inside: &str) -> String {
    format!("<section class=\"card\">\n<h2>{title}</h2>\n{inside}</section>\n")
}

/// Cells as a table: rows without a flight are left out.
fn table(cells: &Table, rows: &[&str], columns: &[&str]) -> String {
    let wide = if columns.len() > Moment::ALL.len() + 1 { " class=\"wide\"" } else { "" };
    let mut text = format!("<div class=\"scroll\"><table{wide}>\n<thead><tr><th></th>");
    columns.iter().for_each(|column| {
        let _ = write!(text, "<th scope=\"col\"><span>{}</span></th>", escape(column));
    });
    text += "</tr></thead>\n<tbody>\n";
    for row in rows {
        let of_row: Vec<_> =
            columns.iter().map(|column| cells.get(&((*row).to_owned(), (*column).to_owned()))).collect();
        if of_row.iter().any(Option::is_some) {
            let _ = write!(text, "<tr><th scope=\"row\">{}</th>", escape(row));
            text.extend(of_row.iter().map(|cell| cell.map_or("<td></td>".into(), shown)));
            text += "</tr>\n";
        }
    }
    text + "</tbody>\n</table></div>\n"
}

fn shown(cell: &Cell) -> String {
    let Cell { flights, idle, wrong, violated, needless, failed, worst, .. } = cell;
    let class = match (failed, idle == flights) {
        (0, true) => "idle",
        (0, false) => "good",
        _ => "bad",
    };
    let count = if *failed > 0 { format!("{failed}/{flights}") } else { flights.to_string() };
    let rate = cell.failing();
    let says = format!(
        "{flights} flights: {wrong} wrong end, {violated} invariant violated, {needless} needless cut, {idle} changed nothing; failed {rate}"
    );
    format!("<td class=\"{class}\" title=\"{says}\"><b>{}</b> <i>{count}</i></td>", escape(worst))
}

fn failures(failures: &[Failure]) -> String {
    let mut text =
        "<div class=\"scroll\"><table class=\"list\">\n<thead><tr><th>fault</th><th>moment</th><th>verdict</th>\
                    <th>flights</th><th>repeat it</th></tr></thead>\n<tbody>\n"
            .to_owned();
    for Failure { fault, phase, verdict, flights, line, .. } in failures {
        let [fault, phase, verdict, line] = [fault, phase, verdict, line].map(|part| escape(part));
        let _ = writeln!(
            text,
            "<tr><th scope=\"row\">{fault}</th><td>{phase}</td><td>{verdict}</td><td>{flights}</td><td><code>{line}</code></td></tr>"
        );
    }
    text + "</tbody>\n</table></div>\n"
}
