//! The messages' types as text, made of the types themselves.

use std::fmt::Write;

use ballbar::wire::{ToBoard, ToHost};
use postcard_schema::Schema;
use postcard_schema::schema::{DataModelType, DataModelVariant, NamedType, NamedValue};

/// Every struct and enum that travels, as Markdown: a section a type, in the order in which the messages name them.
pub fn wire_types_as_markdown() -> String {
    let mut text = String::new();
    for named in wire_types() {
        let _ = write!(text, "### `{}`\n\n", named.name);
        match named.ty {
            DataModelType::Struct(fields) => {
                text.push_str("| field | type |\n| --- | --- |\n");
                for field in *fields {
                    let _ = writeln!(text, "| `{}` | {} |", field.name, type_name(field.ty));
                }
            }
            DataModelType::Enum(variants) => {
                text.push_str("| | variant | holds |\n| --- | --- | --- |\n");
                for (number, variant) in variants.iter().enumerate() {
                    let _ = writeln!(text, "| {number} | `{}` | {} |", variant.name, content(variant.ty));
                }
            }
            _ => {}
        }
        text.push('\n');
    }
    text
}

/// The structs and enums of both directions, each once.
fn wire_types() -> Vec<&'static NamedType> {
    let mut found = Vec::new();
    collect(ToBoard::SCHEMA, &mut found);
    collect(ToHost::SCHEMA, &mut found);
    found
}

fn collect(named: &'static NamedType, found: &mut Vec<&'static NamedType>) {
    if found.contains(&named) {
        return;
    }
    let inner: Vec<&'static NamedType> = match named.ty {
        DataModelType::Struct(fields) => fields.iter().map(|field| field.ty).collect(),
        DataModelType::Enum(variants) => variants.iter().flat_map(|variant| types_in(variant.ty)).collect(),
        DataModelType::Option(inner) | DataModelType::Seq(inner) | DataModelType::NewtypeStruct(inner) => vec![inner],
        DataModelType::Tuple(parts) | DataModelType::TupleStruct(parts) => parts.to_vec(),
        _ => return,
    };
    // `Result` belongs to the language.
    let is_ours = matches!(named.ty, DataModelType::Struct(_) | DataModelType::Enum(_)) && !is_result(named);
    if is_ours {
        found.push(named);
    }
    for named in inner {
        collect(named, found);
    }
}

fn types_in(variant: &'static DataModelVariant) -> Vec<&'static NamedType> {
    match variant {
        DataModelVariant::UnitVariant => Vec::new(),
        DataModelVariant::NewtypeVariant(inner) => vec![inner],
        DataModelVariant::TupleVariant(parts) => parts.to_vec(),
        DataModelVariant::StructVariant(fields) => fields.iter().map(|field| field.ty).collect(),
    }
}

fn content(variant: &DataModelVariant) -> String {
    match variant {
        DataModelVariant::UnitVariant => String::new(),
        DataModelVariant::NewtypeVariant(inner) => type_name(inner),
        DataModelVariant::TupleVariant(parts) => list(parts.iter().map(|part| type_name(part))),
        DataModelVariant::StructVariant(fields) => list(fields.iter().map(|field| with_name(field))),
    }
}

fn with_name(field: &NamedValue) -> String {
    format!("`{}`: {}", field.name, type_name(field.ty))
}

fn type_name(named: &NamedType) -> String {
    match named.ty {
        DataModelType::Option(inner) => format!("optional {}", type_name(inner)),
        DataModelType::Seq(inner) => format!("sequence of {}", type_name(inner)),
        DataModelType::Tuple([first, rest @ ..]) if !rest.is_empty() && rest.iter().all(|part| part == first) => {
            format!("{} × {}", rest.len() + 1, type_name(first))
        }
        DataModelType::Tuple(parts) => list(parts.iter().map(|part| type_name(part))),
        DataModelType::Enum(variants) if is_result(named) => {
            list(variants.iter().map(|variant| format!("`{}`: {}", variant.name, content(variant.ty))))
        }
        DataModelType::Struct(_) | DataModelType::Enum(_) => format!("`{}`", named.name),
        DataModelType::String => "text".to_owned(),
        primitive => format!("{primitive:?}").to_lowercase(),
    }
}

fn is_result(named: &NamedType) -> bool {
    named.name.starts_with("Result<")
}

fn list(parts: impl Iterator<Item = String>) -> String {
    parts.collect::<Vec<_>>().join(", ")
}
