//! Self-contained HTML page with the image, its wakes and a table.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use crate::geojson::properties;
use crate::wake::MappedWake;

const PAGE: &str = include_str!("report.html");

/// Returns an HTML page with the image to pan and zoom, wakes to hover over and to filter by score, a table, and the settings.
///
/// - `title`: name of the image
/// - `size`: pixels and lines of the image
/// - `picture`: the image as a PNG file, of any size
/// - `settings`: names and values to show below the table
#[must_use]
pub fn html(
    wakes: &[MappedWake],
    title: &str,
    size: [usize; 2],
    picture: &[u8],
    settings: &[(&str, String)],
) -> String {
    let wake = |(n, wake): (usize, &MappedWake)| {
        let mut value = Value::Object(properties(wake));
        let place = |axis: usize| wake.tip.map(|tip| tip[axis]);
        value["id"] = json!(n + 1);
        (value["longitude"], value["latitude"]) = (json!(place(0)), json!(place(1)));
        value["from"] = json!([wake.pixel, wake.line]);
        value["to"] = json!(wake.end_px);
        value["echo"] = json!(wake.echo.map(|echo| [echo.pixel, echo.line]));
        value
    };
    let wakes: Vec<Value> = wakes.iter().enumerate().map(wake).collect();
    let settings: serde_json::Map<String, Value> = settings
        .iter()
        .map(|(name, value)| ((*name).to_owned(), json!(value)))
        .collect();
    let data = json!({"size": size, "wakes": wakes, "settings": settings}).to_string();
    // Keep text in the data from closing its HTML element.
    let data = data.replace('<', "\\u003c");
    let title: String = title
        .chars()
        .map(|c| match c {
            '<' => "&lt;".to_owned(),
            '>' => "&gt;".to_owned(),
            '&' => "&amp;".to_owned(),
            c => c.to_string(),
        })
        .collect();
    // The picture last, so that its content is not searched for the other markers.
    PAGE.replace("TITLE", &title)
        .replace(">DATA<", &format!(">{data}<"))
        .replace("PICTURE", &STANDARD.encode(picture))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn foreign_text_cannot_leave_its_place() {
        let settings = [("weights", "</script><b>".to_owned())];
        let page = html(&[], "a<b>.SAFE", [10, 20], b"png", &settings);
        assert!(page.contains("a&lt;b&gt;.SAFE") && page.contains("\\u003c/script>"));
        assert_eq!(page.matches("</script>").count(), 2);
        assert!(page.contains("base64,cG5n"));
        for address in ["http://", "https://"] {
            let others = page.replace("http://www.w3.org/2000/svg", "");
            assert!(!others.contains(address), "a network address");
        }
    }
}
