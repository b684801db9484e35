//! ISO 10303-21 ("STEP physical files"): instances and their arguments, without meaning.

use std::collections::BTreeMap;

/// An argument.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    /// `$` or `*`.
    Missing,
    Reference(u64),
    Number(f64),
    /// Enumerations without their dots, strings without quotes.
    Word(String),
    List(Vec<Value>),
}

/// One record of an instance: complex instances have several.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Record {
    pub(super) name: String,
    pub(super) arguments: Vec<Value>,
}

pub(super) type Instances = BTreeMap<u64, Vec<Record>>;

/// Deepest nesting of lists.
const DEEPEST: usize = 16;

struct Parser<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Parser<'_> {
    fn fail<T>(&self, what: &str) -> Result<T, String> {
        let line = 1 + self.bytes[..self.at.min(self.bytes.len())].iter().filter(|b| **b == b'\n').count();
        Err(format!("line {line}: {what}"))
    }

    fn peek(&mut self) -> Option<u8> {
        loop {
            match self.bytes.get(self.at) {
                Some(b) if b.is_ascii_whitespace() => self.at += 1,
                Some(b'/') if self.bytes.get(self.at + 1) == Some(&b'*') => {
                    let end = self.bytes[self.at + 2..].windows(2).position(|w| w == b"*/");
                    self.at = end.map_or(self.bytes.len(), |e| self.at + e + 4);
                }
                b => return b.copied(),
            }
        }
    }

    fn eat(&mut self, b: u8) -> bool {
        let found = self.peek() == Some(b);
        self.at += usize::from(found);
        found
    }

    fn want(&mut self, b: u8) -> Result<(), String> {
        if self.eat(b) { Ok(()) } else { self.fail(&format!("{:?} is missing", b as char)) }
    }

    fn word(&mut self) -> String {
        self.peek();
        let start = self.at;
        while self.bytes.get(self.at).is_some_and(|b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'-')) {
            self.at += 1;
        }
        String::from_utf8_lossy(&self.bytes[start..self.at]).to_ascii_uppercase()
    }

    fn id(&mut self) -> Result<u64, String> {
        let word = self.word();
        word.parse().or_else(|_| self.fail(&format!("#{word} is no instance number")))
    }

    fn string(&mut self) -> Result<Value, String> {
        let mut text = Vec::new();
        loop {
            match self.bytes.get(self.at) {
                None => return self.fail("a string does not end"),
                Some(b'\'') if self.bytes.get(self.at + 1) == Some(&b'\'') => {
                    text.push(b'\'');
                    self.at += 2;
                }
                Some(b'\'') => {
                    self.at += 1;
                    return Ok(Value::Word(String::from_utf8_lossy(&text).into_owned()));
                }
                Some(&b) => {
                    text.push(b);
                    self.at += 1;
                }
            }
        }
    }

    fn value(&mut self, depth: usize) -> Result<Value, String> {
        match self.peek() {
            Some(b'$' | b'*') => {
                self.at += 1;
                Ok(Value::Missing)
            }
            Some(b'#') => {
                self.at += 1;
                Ok(Value::Reference(self.id()?))
            }
            Some(b'\'') => {
                self.at += 1;
                self.string()
            }
            Some(b'"') => {
                self.at += 1;
                while self.bytes.get(self.at).is_some_and(|b| *b != b'"') {
                    self.at += 1;
                }
                self.want(b'"')?;
                Ok(Value::Missing)
            }
            Some(b'.') => {
                self.at += 1;
                let word = self.word();
                self.want(b'.')?;
                Ok(Value::Word(word))
            }
            Some(b'(') => self.list(depth),
            Some(b) if b.is_ascii_digit() || matches!(b, b'+' | b'-') => self.number(),
            Some(b) if b.is_ascii_alphabetic() => {
                // a typed parameter: LENGTH_MEASURE(1.0)
                self.word();
                let mut list = match self.list(depth)? {
                    Value::List(list) => list,
                    other => vec![other],
                };
                Ok(if list.len() == 1 { list.remove(0) } else { Value::List(list) })
            }
            _ => self.fail("an argument is missing"),
        }
    }

    fn number(&mut self) -> Result<Value, String> {
        let start = self.at;
        while self
            .bytes
            .get(self.at)
            .is_some_and(|b| b.is_ascii_digit() || matches!(b, b'+' | b'-' | b'.' | b'e' | b'E'))
        {
            self.at += 1;
        }
        let text = std::str::from_utf8(&self.bytes[start..self.at]).unwrap_or_default();
        match text.parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(Value::Number(x)),
            _ => self.fail(&format!("{text} is no finite number")),
        }
    }

    fn list(&mut self, depth: usize) -> Result<Value, String> {
        if depth == DEEPEST {
            return self.fail(&format!("lists are nested more than {DEEPEST} deep"));
        }
        self.want(b'(')?;
        let mut out = Vec::new();
        if self.eat(b')') {
            return Ok(Value::List(out));
        }
        loop {
            out.push(self.value(depth + 1)?);
            if self.eat(b')') {
                return Ok(Value::List(out));
            }
            self.want(b',')?;
        }
    }

    fn record(&mut self) -> Result<Record, String> {
        let name = self.word();
        if name.is_empty() {
            return self.fail("the name of an entity is missing");
        }
        match self.list(0)? {
            Value::List(arguments) => Ok(Record { name, arguments }),
            _ => self.fail("the arguments of an entity are missing"),
        }
    }
}

/// All instances of the data sections. Time and memory grow with the length of the text alone.
pub(super) fn parse(text: &str) -> Result<Instances, String> {
    let mut p = Parser { bytes: text.as_bytes(), at: 0 };
    if p.word() != "ISO-10303-21" {
        return Err("no STEP file: it does not begin with ISO-10303-21;".to_owned());
    }
    p.want(b';')?;
    let mut out = Instances::new();
    loop {
        match p.peek() {
            None => return Ok(out),
            Some(b'#') => {
                p.at += 1;
                let id = p.id()?;
                p.want(b'=')?;
                let mut records = Vec::new();
                if p.eat(b'(') {
                    while !p.eat(b')') {
                        records.push(p.record()?);
                    }
                } else {
                    records.push(p.record()?);
                }
                p.want(b';')?;
                out.insert(id, records);
            }
            Some(_) => {
                let word = p.word();
                if word == "END-ISO-10303-21" {
                    return Ok(out);
                }
                if word.is_empty() {
                    return p.fail("a statement is expected");
                }
                // HEADER; FILE_NAME(...); ENDSEC; DATA; ...
                if p.peek() == Some(b'(') {
                    p.list(0)?;
                }
                p.want(b';')?;
            }
        }
    }
}
