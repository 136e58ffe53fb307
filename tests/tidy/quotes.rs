//! Numbers that pages quote from reports: `[0.85](reports/detector.md "real, clear wakes; network; AP")` names cells of
//! the row (or of the head of its table) and, last, the column.

use super::pages;
use std::fs;
use std::path::Path;

/// A number in a page, and the place in a report that it is quoted from.
#[derive(Debug, PartialEq)]
struct Quote {
    text: String,
    report: String,
    cells: Vec<String>,
}

/// How many numbers a page quotes from reports, and which of them differ from the report or name no place in it.
pub(crate) fn wrong_quotes(page: &Path) -> (usize, Vec<String>) {
    let text = fs::read_to_string(page).expect("a page");
    let quotes = quotes(&text);
    let mut wrong = Vec::new();
    for quote in &quotes {
        let report = page.parent().expect("a folder").join(&quote.report);
        let report = fs::read_to_string(report).unwrap_or_default();
        if let Err(why) = check(quote, &report) {
            let Quote { text, report, .. } = quote;
            wrong.push(format!("{}: {text} of {report}: {why}", page.display()));
        }
    }
    (quotes.len(), wrong)
}

/// Links to reports whose text is a number.
fn quotes(page: &str) -> Vec<Quote> {
    let found = pages::titled_links(page).into_iter();
    let found = found.filter(|(text, target, _)| {
        target.contains("reports/") && text.starts_with(|c: char| c.is_ascii_digit() || c == '−')
    });
    found
        .map(|(text, report, title)| Quote {
            text,
            report,
            cells: title
                .split(';')
                .map(|cell| cell.trim().to_owned())
                .collect(),
        })
        .collect()
}

/// Compares a quote with the one cell of the report that it names.
fn check(quote: &Quote, report: &str) -> Result<(), String> {
    let Some((column, row)) = quote.cells.split_last().filter(|(_, row)| !row.is_empty()) else {
        return Err("names no row and column: [number](report \"row; column\")".to_owned());
    };
    let mut cells = Vec::new();
    for table in tables(report) {
        let Some(at) = table[0].iter().position(|head| head == column) else {
            continue;
        };
        let rows = table.iter().skip(2).filter(|cells| {
            row.iter()
                .all(|name| cells.contains(name) || table[0].contains(name))
        });
        cells.extend(rows.filter_map(|cells| cells.get(at).cloned()));
    }
    let [cell] = &cells[..] else {
        return Err(format!(
            "{:?} is in {} rows of tables",
            quote.cells,
            cells.len()
        ));
    };
    let percent = quote.text.contains('%') && !cell.contains('%');
    let scale = if percent { 100.0 } else { 1.0 };
    let (quoted, reported) = (numbers(&quote.text), numbers(cell));
    let agrees = |(quoted, reported): (&(f64, i32), &(f64, i32))| {
        let half = 0.5 * 10f64.powi(-quoted.1);
        (scale * reported.0 - quoted.0).abs() <= half * (1.0 + 1e-9)
    };
    let same = reported.len() >= quoted.len() && quoted.iter().zip(&reported).all(agrees);
    same.then_some(())
        .ok_or_else(|| format!("the report has {cell}"))
}

/// Tables of a page: rows of cells, the head first and the line below it second.
fn tables(page: &str) -> Vec<Vec<Vec<String>>> {
    let mut tables: Vec<Vec<Vec<String>>> = vec![Vec::new()];
    for line in page.lines() {
        match line.strip_prefix('|') {
            Some(row) => {
                let row = row.trim_end().trim_end_matches('|');
                let cells = row.split('|').map(|cell| cell.trim().to_owned());
                tables.last_mut().expect("one").push(cells.collect());
            }
            None => tables.push(Vec::new()),
        }
    }
    tables.retain(|table| table.len() > 2);
    tables
}

/// The numbers of a text and their digits after the point.
fn numbers(text: &str) -> Vec<(f64, i32)> {
    let plain = text.replace('−', "-").replace(',', "");
    let pieces = plain.split(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-'));
    let digits = |piece: &str| piece.split_once('.').map_or(0, |(_, end)| end.len() as i32);
    pieces
        .filter_map(|piece| Some((piece.parse().ok()?, digits(piece))))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const REPORT: &str = "| images | found by | AP |\n| --- | --- | --- |\n| real, clear | network | 0.847 |\n\
        | real, clear | Radon | 0.342 ± 0.02 |\n";

    fn check_of(page: &str) -> Result<(), String> {
        let quotes = quotes(page);
        assert_eq!(quotes.len(), 1, "{page}");
        check(&quotes[0], REPORT)
    }

    #[test]
    fn quotes_are_compared_with_their_cell() {
        for right in [
            "[0.85](reports/a.md \"real, clear; network; AP\")",
            "so\n[0.34 ± 0.02](../reports/a.md \"real, clear; Radon;\nAP\") of",
            "[85 %](reports/a.md \"network; AP\")",
        ] {
            assert_eq!(check_of(right), Ok(()), "{right}");
        }
        for wrong in [
            "[0.84](reports/a.md \"real, clear; network; AP\")",
            "[0.34 ± 0.03](reports/a.md \"Radon; AP\")",
            "[0.85 ± 0.01](reports/a.md \"network; AP\")",
            "[0.85](reports/a.md \"real, clear; AP\")",
            "[0.85](reports/a.md \"network; recall\")",
            "[0.85](reports/a.md)",
        ] {
            assert!(check_of(wrong).is_err(), "{wrong}");
        }
        assert!(quotes("[report](reports/a.md) [12](b.md)").is_empty());
    }
}
