//! The schema as an XML Schema document.

use std::fmt::Write;

use super::schema::{Attribute, Element, Kind, ROOT, Target};

/// The schema of FYSL 1.0 as an XML Schema document, for editors and exporters.
///
/// It says what elements and attributes there are and what kinds of values they take. What only the
/// reader checks - ids, rotations, counts of numbers, expressions - it does not know.
#[must_use]
pub fn fysl_xsd() -> String {
    let mut text = String::from(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <xs:schema xmlns:xs=\"http://www.w3.org/2001/XMLSchema\" version=\"1.0\">\n",
    );
    element(&mut text, &ROOT, 1);
    text += "</xs:schema>\n";
    text
}

fn element(text: &mut String, schema: &Element, depth: usize) {
    let indent = "  ".repeat(depth);
    let is_root = depth == 1;
    let is_many = matches!(schema.target, Target::Item(..) | Target::Value(_));
    let occurs = match (is_root, is_many) {
        (true, _) => "",
        (_, true) => " minOccurs=\"0\" maxOccurs=\"unbounded\"",
        _ => " minOccurs=\"0\"",
    };
    let tag = schema.tag;
    // Writing to a string cannot fail.
    if let Some((_, kind)) = schema.text {
        let _ =
            writeln!(text, "{indent}<xs:element name=\"{tag}\" type=\"{}\"{occurs}/>", name(kind));
        return;
    }
    let _ = writeln!(text, "{indent}<xs:element name=\"{tag}\"{occurs}>");
    let _ = writeln!(text, "{indent}  <xs:complexType>");
    if !schema.children.is_empty() {
        // In any order.
        let _ = writeln!(text, "{indent}    <xs:choice minOccurs=\"0\" maxOccurs=\"unbounded\">");
        for child in schema.children {
            element(text, child, depth + 3);
        }
        let _ = writeln!(text, "{indent}    </xs:choice>");
    }
    for attribute in schema.attributes {
        self::attribute(text, attribute, &indent);
    }
    let _ = writeln!(text, "{indent}  </xs:complexType>");
    let _ = writeln!(text, "{indent}</xs:element>");
}

fn attribute(text: &mut String, attribute: &Attribute, indent: &str) {
    let usage = if attribute.required { " use=\"required\"" } else { "" };
    let start = format!("{indent}    <xs:attribute name=\"{}\"", attribute.name);
    if let Kind::Word(words) = attribute.kind {
        let _ = writeln!(text, "{start}{usage}>");
        let _ = writeln!(text, "{indent}      <xs:simpleType><xs:restriction base=\"xs:string\">");
        for word in words {
            let _ = writeln!(text, "{indent}        <xs:enumeration value=\"{word}\"/>");
        }
        let _ = writeln!(text, "{indent}      </xs:restriction></xs:simpleType>");
        let _ = writeln!(text, "{indent}    </xs:attribute>");
    } else {
        let _ = writeln!(text, "{start} type=\"{}\"{usage}/>", name(attribute.kind));
    }
}

/// Lists of numbers are strings to XML Schema, as it has no lists of a given length without a type of
/// their own.
const fn name(kind: Kind) -> &'static str {
    match kind {
        Kind::Number => "xs:double",
        Kind::Count => "xs:unsignedInt",
        Kind::Id | Kind::Particle => "xs:positiveInteger",
        Kind::Switch => "xs:boolean",
        _ => "xs:string",
    }
}
