//! XML files as small trees, read within limits.

use quick_xml::Reader;
use quick_xml::events::Event;

use crate::error::{Error, Result};
use crate::limits::{NUMBERS, XML_BYTES, XML_DEPTH, XML_ELEMENTS};
use whole_files::sentence;

/// Element of an XML file: name without prefix, text, children. Attributes are not kept.
#[derive(Debug, Default)]
struct Element {
    name: String,
    text: String,
    children: Vec<Self>,
}

/// XML file in memory.
#[derive(Debug)]
pub(crate) struct Document {
    file: String,
    root: Element,
}

/// Reference to one element of a document.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node<'a> {
    file: &'a str,
    element: &'a Element,
}

impl Document {
    /// Parses the text of a file; `file` names the file in errors.
    ///
    /// # Errors
    /// Text that is not well-formed XML, has a document type (whose entities could expand without bound), or exceeds
    /// a limit.
    pub(crate) fn parse(file: &str, text: &str) -> Result<Self> {
        check_limit(file, "the size in bytes", text.len() as u64, XML_BYTES)?;
        let damaged = |why: String| Error::damaged(file, sentence(&why));
        let mut reader = Reader::from_str(text);
        let mut open = vec![Element::default()];
        let mut elements = 0;
        loop {
            let event = reader.read_event().map_err(|e| {
                damaged(format!(
                    "it is not valid XML at byte {} ({e})",
                    reader.error_position()
                ))
            })?;
            let here = open.last_mut().expect("the element above the root");
            match event {
                Event::Start(start) | Event::Empty(start) if elements >= XML_ELEMENTS => {
                    let _ = start;
                    check_limit(
                        file,
                        "the number of elements",
                        elements as u64 + 1,
                        XML_ELEMENTS as u64,
                    )?;
                }
                Event::Start(start) => {
                    elements += 1;
                    check_limit(
                        file,
                        "the depth of elements",
                        open.len() as u64,
                        XML_DEPTH as u64,
                    )?;
                    open.push(named(start.local_name().as_ref()));
                }
                Event::Empty(start) => {
                    elements += 1;
                    here.children.push(named(start.local_name().as_ref()));
                }
                Event::End(_) => {
                    let done = open.pop().expect("the parser checks that ends match");
                    let Some(parent) = open.last_mut() else {
                        return Err(damaged("it has an end tag without a start tag".to_owned()));
                    };
                    parent.children.push(done);
                }
                Event::Text(part) => here.text.push_str(&part.xml10_content()),
                Event::CData(part) => here.text.push_str(&part.xml10_content()),
                Event::DocType(_) => {
                    return Err(damaged(
                        "it has a document type, which products never have".to_owned(),
                    ));
                }
                Event::Eof => break,
                // No number or name that is read contains references.
                Event::GeneralRef(_) => here.text.push(char::REPLACEMENT_CHARACTER),
                Event::Comment(_) | Event::Decl(_) | Event::PI(_) => {}
            }
        }
        if open.len() != 1 {
            let name = open.last().map(|e| e.name.as_str()).unwrap_or_default();
            return Err(damaged(format!("it ends inside the element {name:?}")));
        }
        let mut top = open.pop().expect("the element above the root");
        match top.children.len() {
            1 => Ok(Self {
                file: file.to_owned(),
                root: top.children.remove(0),
            }),
            count => Err(damaged(format!(
                "it has {count} root elements instead of 1"
            ))),
        }
    }

    /// The root element.
    pub(crate) fn root(&self) -> Node<'_> {
        Node {
            file: &self.file,
            element: &self.root,
        }
    }
}

fn named(name: &str) -> Element {
    Element {
        name: name.to_owned(),
        ..Element::default()
    }
}

fn check_limit(file: &str, what: &'static str, value: u64, limit: u64) -> Result<()> {
    match value <= limit {
        true => Ok(()),
        false => Err(Error::TooLarge {
            file: file.to_owned(),
            what,
            value,
            limit,
            remedy: "no Sentinel-1 product needs more: download the product again",
        }),
    }
}

impl<'a> Node<'a> {
    /// Error about this file.
    pub(crate) fn error(self, why: impl AsRef<str>) -> Error {
        Error::damaged(self.file, sentence(why.as_ref()))
    }

    /// Name of the element, without prefix.
    pub(crate) fn name(self) -> &'a str {
        &self.element.name
    }

    /// Children with the given name.
    pub(crate) fn children(self, name: &str) -> impl Iterator<Item = Self> {
        let file = self.file;
        let matching = self.element.children.iter().filter(move |e| e.name == name);
        matching.map(move |element| Self { file, element })
    }

    /// First element at the path `a/b/c` below this one, if there is one.
    pub(crate) fn find(self, path: &str) -> Option<Self> {
        path.split('/')
            .try_fold(self, |node, name| node.children(name).next())
    }

    /// First element at the path `a/b/c` below this one; an error if there is none.
    pub(crate) fn get(self, path: &str) -> Result<Self> {
        self.find(path)
            .ok_or_else(|| self.error(format!("element {:?} has no {path:?}", self.name())))
    }

    /// Text of the element, trimmed.
    pub(crate) fn text(self) -> &'a str {
        self.element.text.trim()
    }

    /// Finite number in the element at a path.
    pub(crate) fn number(self, path: &str) -> Result<f64> {
        let node = self.get(path)?;
        node.parsed(node.text())
    }

    /// Finite number within a closed range, in the element at a path.
    pub(crate) fn number_in(self, path: &str, min: f64, max: f64) -> Result<f64> {
        let value = self.number(path)?;
        match (min..=max).contains(&value) {
            true => Ok(value),
            false => Err(self.error(format!("{path} is {value}, outside [{min}, {max}]"))),
        }
    }

    /// Whole number within a closed range, in the element at a path.
    pub(crate) fn integer_in(self, path: &str, min: i64, max: i64) -> Result<i64> {
        let value = self.get(path)?.text();
        match value.parse::<i64>() {
            Ok(value) if (min..=max).contains(&value) => Ok(value),
            _ => Err(self.error(format!(
                "{path} is {value:?}, expected a whole number in [{min}, {max}]"
            ))),
        }
    }

    /// List of finite numbers, at most [`NUMBERS`], in the element at a path.
    pub(crate) fn numbers(self, path: &str) -> Result<Vec<f64>> {
        let node = self.get(path)?;
        let mut values = Vec::new();
        for word in node.text().split_ascii_whitespace() {
            check_limit(
                self.file,
                "the length of a list",
                values.len() as u64 + 1,
                NUMBERS as u64,
            )?;
            values.push(node.parsed(word)?);
        }
        Ok(values)
    }

    fn parsed(self, word: &str) -> Result<f64> {
        match word.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(self.error(format!(
                "{} is {word:?}, expected a finite number",
                self.name()
            ))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sentence(text: &str) -> String {
        Document::parse("a.xml", text)
            .expect_err("bad XML")
            .to_string()
    }

    #[test]
    fn numbers_are_found_by_their_path() {
        let text = "<?xml version=\"1.0\"?><a xmlns:n=\"x\"><n:b><c>1.5</c><d> 1 2\n3 </d></n:b><b><c>2</c></b></a>";
        let document = Document::parse("a.xml", text).expect("XML");
        assert_eq!(
            document.root().numbers("b/d").expect("a list"),
            [1.0, 2.0, 3.0]
        );
        assert_eq!(document.root().children("b").count(), 2);
        assert!(document.root().number("b/e").is_err());
        assert!(document.root().number_in("b/c", 2.0, 3.0).is_err());
    }

    #[test]
    fn tricks_are_refused() {
        let bomb = "<!DOCTYPE a [<!ENTITY b \"bbbb\">]><a>&b;</a>";
        assert!(sentence(bomb).contains("document type"));
        assert!(sentence(&"<a>".repeat(100)).contains("depth"));
        assert!(
            sentence(&format!("<a>{}</a>", "<b/>".repeat(XML_ELEMENTS + 1)))
                .contains("number of elements")
        );
        assert!(sentence(&" ".repeat(XML_BYTES as usize + 1)).contains("size in bytes"));
        for text in ["", "<a>", "<a></b>", "</a>", "<a/><b/>", "text"] {
            sentence(text);
        }
    }
}
