//! XML files as trees that can be changed and written back.

use std::fmt::Write as _;

use quick_xml::Reader;
use quick_xml::events::Event;

use crate::error::{Error, Result};
use crate::xml::Document;
use whole_files::sentence;

/// Element of an XML file with its content, escaped as in the file. Comments are not kept.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    /// Name with its prefix.
    pub(crate) name: String,
    /// Attributes as written after the name.
    attributes: String,
    /// Text, if the element has no children.
    pub(crate) text: String,
    pub(crate) children: Vec<Self>,
}

impl Tree {
    /// An element without attributes.
    pub(crate) fn new(name: &str, text: impl std::fmt::Display) -> Self {
        Self {
            name: name.to_owned(),
            text: text.to_string(),
            ..Self::default()
        }
    }

    /// Parses the text of a file within the limits; `file` names the file in errors.
    pub(crate) fn parse(file: &str, text: &str) -> Result<Self> {
        // Rejects files that are damaged or exceed a limit.
        Document::parse(file, text)?;
        let mut reader = Reader::from_str(text);
        let mut open = vec![Self::default()];
        loop {
            let event = reader.read_event();
            let event = event.map_err(|e| Error::damaged(file, sentence(&e.to_string())))?;
            let named = |start: &quick_xml::events::BytesStart<'_>| Self {
                name: start.name().as_ref().to_owned(),
                attributes: start.attributes_raw().trim().to_owned(),
                ..Self::default()
            };
            match event {
                Event::Start(start) => open.push(named(&start)),
                Event::Empty(start) => {
                    if let Some(parent) = open.last_mut() {
                        parent.children.push(named(&start));
                    }
                }
                Event::End(_) => {
                    let done = open.pop().unwrap_or_default();
                    if let Some(parent) = open.last_mut() {
                        parent.children.push(done);
                    }
                }
                Event::Text(part) => {
                    if let Some(here) = open.last_mut() {
                        here.text.push_str(&part);
                    }
                }
                Event::GeneralRef(reference) => {
                    if let Some(here) = open.last_mut() {
                        let _ = write!(here.text, "&{};", &*reference);
                    }
                }
                Event::Eof => break,
                Event::CData(_)
                | Event::Comment(_)
                | Event::Decl(_)
                | Event::PI(_)
                | Event::DocType(_) => {}
            }
        }
        let root = open.pop().and_then(|mut top| top.children.pop());
        root.ok_or_else(|| Error::damaged(file, "it has no root element"))
    }

    /// Value of an attribute, escaped as in the file.
    pub(crate) fn attribute(&self, name: &str) -> Option<&str> {
        let at = self.attributes.find(&format!("{name}=\""))?;
        let value = &self.attributes[at + name.len() + 2..];
        value.split('"').next()
    }

    /// Replaces the value of an existing attribute.
    pub(crate) fn set_attribute(&mut self, name: &str, value: impl std::fmt::Display) {
        if let Some(old) = self.attribute(name) {
            let old = format!("{name}=\"{old}\"");
            let new = format!("{name}=\"{value}\"");
            self.attributes = self.attributes.replace(&old, &new);
        }
    }

    /// First element at the path `a/b/c` below this one.
    pub(crate) fn find(&self, path: &str) -> Option<&Self> {
        path.split('/').try_fold(self, |tree, name| {
            tree.children.iter().find(|c| c.name == name)
        })
    }

    /// First element at the path `a/b/c` below this one, mutable.
    pub(crate) fn find_mut(&mut self, path: &str) -> Option<&mut Self> {
        path.split('/').try_fold(self, |tree, name| {
            tree.children.iter_mut().find(|c| c.name == name)
        })
    }

    /// Applies `change` to this element and all below it, in the order of the file.
    pub(crate) fn for_each(&mut self, change: &mut impl FnMut(&mut Self)) {
        change(self);
        self.children.iter_mut().for_each(|c| c.for_each(change));
    }

    /// Replaces the text of the element at a path, if there is one.
    pub(crate) fn set(&mut self, path: &str, value: impl std::fmt::Display) {
        if let Some(found) = self.find_mut(path) {
            found.text = value.to_string();
        }
    }

    /// Number in the element at a path.
    pub(crate) fn number(&self, path: &str) -> Option<f64> {
        self.find(path)?.text.trim().parse().ok()
    }

    /// List of numbers in the element at a path.
    pub(crate) fn numbers(&self, path: &str) -> Option<Vec<f64>> {
        let words = self.find(path)?.text.split_ascii_whitespace();
        words.map(|word| word.parse().ok()).collect()
    }

    /// Replaces the list of numbers at a path and its attribute `count`.
    pub(crate) fn set_numbers(&mut self, path: &str, values: impl Iterator<Item = String>) {
        if let Some(found) = self.find_mut(path) {
            let values: Vec<String> = values.collect();
            found.set_attribute("count", values.len());
            found.text = values.join(" ");
        }
    }

    /// Replaces the children of the element at a path and its attribute `count`.
    pub(crate) fn set_children(&mut self, path: &str, children: Vec<Self>) {
        if let Some(found) = self.find_mut(path) {
            found.set_attribute("count", children.len());
            found.children = children;
        }
    }

    /// Text of a file with this root.
    pub(crate) fn to_text(&self) -> String {
        let mut text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n".to_owned();
        self.write(&mut text, 0);
        text
    }

    fn write(&self, out: &mut String, depth: usize) {
        let indent = "  ".repeat(depth);
        let space = if self.attributes.is_empty() { "" } else { " " };
        let _ = write!(out, "{indent}<{}{space}{}", self.name, self.attributes);
        if self.children.is_empty() {
            let text = self.text.trim();
            let _ = match text.is_empty() {
                true => writeln!(out, "/>"),
                false => writeln!(out, ">{text}</{}>", self.name),
            };
            return;
        }
        out.push_str(">\n");
        for child in &self.children {
            child.write(out, depth + 1);
        }
        let _ = writeln!(out, "{indent}</{}>", self.name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_changed_stays() {
        let text = "<?xml version=\"1.0\"?><x:a xmlns:x=\"u\" b=\"1 &amp; 2\"><c count=\"2\">1 2</c><d/><e>&lt;é</e></x:a>";
        let mut tree = Tree::parse("a.xml", text).expect("XML");
        assert_eq!(tree.attribute("b"), Some("1 &amp; 2"));
        assert_eq!(tree.numbers("c"), Some(vec![1.0, 2.0]));
        tree.set_numbers("c", ["7", "8", "9"].into_iter().map(str::to_owned));
        let written = tree.to_text();
        assert!(written.contains("<c count=\"3\">7 8 9</c>"), "{written}");
        assert!(written.contains("<e>&lt;é</e>"), "{written}");
        assert!(
            written.contains("<x:a xmlns:x=\"u\" b=\"1 &amp; 2\">"),
            "{written}"
        );
        let again = Tree::parse("a.xml", &written).expect("XML");
        assert_eq!(again.to_text(), written);
    }
}
