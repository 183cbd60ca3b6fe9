//! Conditions on the values of points: `classification == 2 && intensity > 100`.
//!
//! A small language of its own: the crates of this kind evaluate one row at a time, by maps of
//! names.

use super::Region;
use glam::DVec3;
use std::{fmt, str::FromStr};

/// A condition, which can be parsed from a text.
///
/// Numbers have `+`, `-`, `*`, `/`, `%`, and the functions `abs`, `sqrt`, `exp`, `log`, `floor`,
/// `min` and `max`. They are compared by `==`, `!=`, `<`, `<=`, `>` and `>=`. Conditions are joined
/// by `&&`, `||` and `!`. A name of other characters than letters, digits, `_` and `.` is written
/// in quotes. A comparison with a missing value is not met. `inside("REGION")` is met in a
/// [`Region`], such as `inside("sphere:0,0,0,2")`.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    text: String,
    root: Node,
    /// The names, each with the column in which it stands first.
    names: Vec<(String, usize)>,
}

#[derive(Debug, Clone, PartialEq)]
enum Node {
    Number(f64),
    /// The value of a name, by its index.
    Value(usize),
    Negative(Box<Node>),
    Not(Box<Node>),
    Both(Operator, Box<[Node; 2]>),
    Call(Function, Vec<Node>),
    /// Whether the place lies in a region, by the indices of the names x, y and z.
    Inside(Box<Region>, [usize; 3]),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Operator {
    Or,
    And,
    Equal,
    Unequal,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    Plus,
    Minus,
    Times,
    Over,
    Rest,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Function {
    Abs,
    Sqrt,
    Exp,
    Log,
    Floor,
    Min,
    Max,
}

/// The operators with their ranks. Those of a higher rank bind tighter. Of two with the same
/// beginning, the longer one comes first.
const OPERATORS: [(&str, Operator, u8); 13] = [
    ("||", Operator::Or, 0),
    ("&&", Operator::And, 1),
    ("==", Operator::Equal, 2),
    ("!=", Operator::Unequal, 2),
    ("<=", Operator::LessOrEqual, 2),
    (">=", Operator::GreaterOrEqual, 2),
    ("<", Operator::Less, 2),
    (">", Operator::Greater, 2),
    ("+", Operator::Plus, 3),
    ("-", Operator::Minus, 3),
    ("*", Operator::Times, 4),
    ("/", Operator::Over, 4),
    ("%", Operator::Rest, 4),
];

/// The functions with the number of their arguments.
const FUNCTIONS: [(&str, Function, usize); 7] = [
    ("abs", Function::Abs, 1),
    ("sqrt", Function::Sqrt, 1),
    ("exp", Function::Exp, 1),
    ("log", Function::Log, 1),
    ("floor", Function::Floor, 1),
    ("min", Function::Min, 2),
    ("max", Function::Max, 2),
];

/// The name of the function that tests a region.
const INSIDE: &str = "inside";

/// The most characters of an expression, and the deepest nesting.
const LONGEST: usize = 1 << 17;
const DEEPEST: usize = 100;

/// What a part of an expression is.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Number,
    Condition,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if *self == Self::Number { "a number" } else { "a condition" })
    }
}

type Parsed<T> = Result<T, String>;

impl FromStr for Expression {
    type Err = String;

    /// The error names the column, from 1, at which the text is wrong.
    fn from_str(text: &str) -> Parsed<Self> {
        if text.len() > LONGEST {
            return Err(format!("has more than {LONGEST} characters"));
        }
        let mut parser = Parser { rest: text, text, names: Vec::new(), depth: 0 };
        let start = parser.column();
        let (root, kind) = parser.binary(0)?;
        parser.skip();
        if !parser.rest.is_empty() {
            return Err(parser.wrong("an operator or the end"));
        }
        expect(start, kind, Kind::Condition)?;
        Ok(Self { text: text.to_owned(), root, names: parser.names })
    }
}

impl fmt::Display for Expression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Expression {
    /// Returns the names whose values it compares.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(|(name, _)| name.as_str())
    }

    /// Returns the column, from 1, in which a name stands first; 1 for other names.
    pub fn column_of(&self, name: &str) -> usize {
        self.names.iter().find(|(other, _)| other == name).map_or(1, |(_, column)| *column)
    }

    /// Returns whether the condition is met, given the value of each name by its index.
    pub(super) fn is_met(&self, value: &dyn Fn(usize) -> f64) -> bool {
        self.root.value(value) != 0.0
    }
}

impl Node {
    /// Returns a number; of a condition 1 if it is met, else 0.
    fn value(&self, of: &dyn Fn(usize) -> f64) -> f64 {
        let truth = |is: bool| f64::from(u8::from(is));
        match self {
            Self::Number(number) => *number,
            Self::Value(name) => of(*name),
            Self::Negative(node) => -node.value(of),
            Self::Not(node) => truth(node.value(of) == 0.0),
            Self::Both(operator, nodes) => {
                let left = nodes[0].value(of);
                let right = || nodes[1].value(of);
                match operator {
                    Operator::Or => truth(left != 0.0 || right() != 0.0),
                    Operator::And => truth(left != 0.0 && right() != 0.0),
                    Operator::Equal => truth(left == right()),
                    // Nothing is known of a missing value, also not that it differs.
                    Operator::Unequal => {
                        let right = right();
                        truth(left != right && !left.is_nan() && !right.is_nan())
                    }
                    Operator::Less => truth(left < right()),
                    Operator::LessOrEqual => truth(left <= right()),
                    Operator::Greater => truth(left > right()),
                    Operator::GreaterOrEqual => truth(left >= right()),
                    Operator::Plus => left + right(),
                    Operator::Minus => left - right(),
                    Operator::Times => left * right(),
                    Operator::Over => left / right(),
                    Operator::Rest => left.rem_euclid(right()),
                }
            }
            Self::Inside(region, axes) => truth(region.contains(DVec3::from_array(axes.map(of)))),
            Self::Call(function, arguments) => {
                let first = arguments[0].value(of);
                match function {
                    Function::Abs => first.abs(),
                    Function::Sqrt => first.sqrt(),
                    Function::Exp => first.exp(),
                    Function::Log => first.ln(),
                    Function::Floor => first.floor(),
                    Function::Min => first.min(arguments[1].value(of)),
                    Function::Max => first.max(arguments[1].value(of)),
                }
            }
        }
    }
}

struct Parser<'a> {
    text: &'a str,
    rest: &'a str,
    names: Vec<(String, usize)>,
    depth: usize,
}

impl<'a> Parser<'a> {
    fn skip(&mut self) {
        self.rest = self.rest.trim_start();
    }

    /// Returns the column of what comes next.
    fn column(&mut self) -> usize {
        self.skip();
        self.text[..self.text.len() - self.rest.len()].chars().count() + 1
    }

    fn wrong(&mut self, wanted: &str) -> String {
        let column = self.column();
        match self.rest.chars().next() {
            Some(next) => format!("column {column}: “{next}” where {wanted} is expected"),
            None => format!("column {column}: it ends where {wanted} is expected"),
        }
    }

    /// Reads this text if it comes next.
    fn takes(&mut self, text: &str) -> bool {
        self.skip();
        let rest = self.rest.strip_prefix(text);
        self.rest = rest.unwrap_or(self.rest);
        rest.is_some()
    }

    /// Reads the next operator of at least this rank.
    fn operator(&mut self, least: u8) -> Option<(Operator, u8)> {
        self.skip();
        let is_next = |(text, ..): &&(&str, Operator, u8)| self.rest.starts_with(*text);
        let (text, operator, rank) = *OPERATORS.iter().find(is_next)?;
        if rank < least {
            return None;
        }
        self.rest = &self.rest[text.len()..];
        Some((operator, rank))
    }

    /// Reads what operators of at least this rank join.
    fn binary(&mut self, least: u8) -> Parsed<(Node, Kind)> {
        let start = self.column();
        let (mut left, mut kind) = self.unary()?;
        while let Some((operator, rank)) = self.operator(least) {
            let of = if rank < 2 { Kind::Condition } else { Kind::Number };
            expect(start, kind, of)?;
            let column = self.column();
            let (right, right_kind) = self.binary(rank + 1)?;
            expect(column, right_kind, of)?;
            left = Node::Both(operator, Box::new([left, right]));
            kind = if rank < 3 { Kind::Condition } else { Kind::Number };
        }
        Ok((left, kind))
    }

    fn unary(&mut self) -> Parsed<(Node, Kind)> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(format!("column {}: it is nested too deeply", self.column()));
        }
        let is_negative = self.takes("-");
        let parsed = if is_negative || !self.rest.starts_with("!=") && self.takes("!") {
            let column = self.column();
            let (node, kind) = self.unary()?;
            let of = if is_negative { Kind::Number } else { Kind::Condition };
            expect(column, kind, of)?;
            let node = Box::new(node);
            (if is_negative { Node::Negative(node) } else { Node::Not(node) }, of)
        } else {
            self.operand()?
        };
        self.depth -= 1;
        Ok(parsed)
    }

    fn operand(&mut self) -> Parsed<(Node, Kind)> {
        if self.takes("(") {
            let inner = self.binary(0)?;
            return if self.takes(")") { Ok(inner) } else { Err(self.wrong("“)”")) };
        }
        let column = self.column();
        match self.rest.chars().next() {
            Some('0'..='9' | '.') => Ok((Node::Number(self.number()?), Kind::Number)),
            Some(quote @ ('"' | '\'' | '“')) => {
                let name = self.quoted(quote, "name")?;
                Ok((self.named(name, column), Kind::Number))
            }
            Some(first) if first.is_alphabetic() || first == '_' => {
                let is_of_name = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
                let end = self.rest.find(|c| !is_of_name(c)).unwrap_or(self.rest.len());
                let (name, rest) = self.rest.split_at(end);
                self.rest = rest;
                if self.takes("(") {
                    match name {
                        INSIDE => self.inside(),
                        name => self.call(name, column),
                    }
                } else {
                    Ok((self.named(name, column), Kind::Number))
                }
            }
            _ => Err(self.wrong("a number, a name or “(”")),
        }
    }

    /// Reads a text in quotes, of which the first comes next. `what` names it in errors.
    fn quoted(&mut self, quote: char, what: &str) -> Parsed<&'a str> {
        let column = self.column();
        let end = if quote == '“' { '”' } else { quote };
        let Some((text, rest)) = self.rest[quote.len_utf8()..].split_once(end) else {
            return Err(format!("column {column}: the {what} has no closing {end}"));
        };
        self.rest = rest;
        Ok(text)
    }

    /// Reads the region of `inside(`, and what closes it.
    fn inside(&mut self) -> Parsed<(Node, Kind)> {
        let column = self.column();
        let Some(quote @ ('"' | '\'' | '“')) = self.rest.chars().next() else {
            return Err(self.wrong("a region in quotes, as in inside(\"sphere:0,0,0,2\"),"));
        };
        let region = self.quoted(quote, "region")?;
        let region = region.parse().map_err(|wrong| format!("column {column}: {wrong}"))?;
        if !self.takes(")") {
            return Err(self.wrong("“)”"));
        }
        let axes = ["x", "y", "z"].map(|name| match self.named(name, column) {
            Node::Value(index) => index,
            _ => 0,
        });
        Ok((Node::Inside(Box::new(region), axes), Kind::Condition))
    }

    /// Returns the node of a name.
    fn named(&mut self, name: &str, column: usize) -> Node {
        let known = self.names.iter().position(|(other, _)| other == name);
        Node::Value(known.unwrap_or_else(|| {
            self.names.push((name.to_owned(), column));
            self.names.len() - 1
        }))
    }

    fn call(&mut self, name: &str, column: usize) -> Parsed<(Node, Kind)> {
        let function = FUNCTIONS.iter().find(|(known, ..)| *known == name);
        let Some((_, function, count)) = function else {
            let known = FUNCTIONS.map(|(name, ..)| name).join(", ") + ", " + INSIDE;
            return Err(format!("column {column}: there is no function “{name}”, only {known}"));
        };
        let mut arguments = Vec::new();
        loop {
            let column = self.column();
            let (node, kind) = self.binary(0)?;
            expect(column, kind, Kind::Number)?;
            arguments.push(node);
            if !self.takes(",") {
                break;
            }
        }
        if arguments.len() != *count {
            let given = arguments.len();
            return Err(format!("column {column}: {name} takes {count} numbers, not {given}"));
        }
        if !self.takes(")") {
            return Err(self.wrong("“)”"));
        }
        Ok((Node::Call(*function, arguments), Kind::Number))
    }

    fn number(&mut self) -> Parsed<f64> {
        let column = self.column();
        let mut before = ' ';
        let is_of_number = |c: char| {
            let is_sign = matches!(c, '+' | '-') && matches!(before, 'e' | 'E');
            before = c;
            c.is_ascii_alphanumeric() || c == '.' || is_sign
        };
        let mut is_of_number = is_of_number;
        let end = self.rest.find(|c| !is_of_number(c)).unwrap_or(self.rest.len());
        let (number, rest) = self.rest.split_at(end);
        self.rest = rest;
        let finite = number.parse().ok().filter(|number: &f64| number.is_finite());
        finite.ok_or_else(|| format!("column {column}: “{number}” is not a number"))
    }
}

/// Refuses a part of the wrong kind.
fn expect(column: usize, kind: Kind, wanted: Kind) -> Parsed<()> {
    if kind == wanted {
        return Ok(());
    }
    Err(format!("column {column}: this is {kind}, and {wanted} is expected"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_met(text: &str, values: &[(&str, f64)]) -> bool {
        let expression: Expression = text.parse().unwrap_or_else(|e| panic!("{text}: {e}"));
        let names: Vec<&str> = expression.names().collect();
        expression.is_met(&|name| {
            let value = values.iter().find(|(known, _)| *known == names[name]);
            value.unwrap_or_else(|| panic!("{text}: {}", names[name])).1
        })
    }

    #[test]
    fn conditions_are_met() {
        let values =
            [("a", 2.0), ("b", -3.0), ("scan angle", 7.0), ("none", f64::NAN), ("n.x_1", 0.5)];
        let values: Vec<_> =
            values.into_iter().chain([("x", 4.0), ("y", 1.0), ("z", 0.0)]).collect();

        for text in [
            "a == 2",
            "a != b && !(a < b)",
            "1 + 2 * 3 == 7 && (1 + 2) * 3 == 9",
            "10 - 4 - 3 == 3 && 8 / 4 / 2 == 1",
            "-a < -1 && - b == 3",
            "a < b || b < a && a >= 2",
            "'scan angle' == 7 && \"scan angle\" > 6.5e0",
            "n.x_1 == 5e-1 && 1.5E+1 == 15 && .5 == n.x_1",
            "max(a, abs(b)) == 3 && sqrt(4) == a && floor(-0.5) == -1 && exp(log(a)) > 1.99",
            "b % 2 == 1",
            "inside(\"xy:0,0,9,0,9,9\") && !inside('sphere:3,1,0,0.5') && x > 2",
            "!(none == 1) && !(none != 1) && !(none < 1) && !(none >= 1)",
        ] {
            assert!(is_met(text, &values), "{text}");
        }
        for text in ["a > 2", "a == 2 && b > 0", "!(a == 2)", "a + b > 0"] {
            assert!(!is_met(text, &values), "{text}");
        }
    }

    #[test]
    fn errors_name_the_column() {
        for (text, column, word) in [
            ("", 1, "ends"),
            ("a", 1, "a condition is expected"),
            ("a = 2", 3, "“=”"),
            ("a == 2 &&", 10, "ends"),
            ("a == 2 && b", 11, "a condition is expected"),
            ("(a == 2", 8, "“)”"),
            ("a == 2)", 7, "an operator"),
            ("(a == 2) + 1 > 0", 1, "a number is expected"),
            ("a < 1x", 5, "“1x”"),
            ("a < 1e999", 5, "not a number"),
            ("sin(a) > 0", 1, "no function “sin”"),
            ("é == 1 && max(a) > 0", 11, "takes 2 numbers"),
            ("'a > 0", 1, "no closing"),
            ("a < b < 3", 1, "a number is expected"),
            ("a > 0 || inside(\"cube:1\")", 17, "“cube:1”"),
            ("inside(a)", 8, "a region in quotes"),
            ("inside(\"sphere:0,0,0,1\"", 24, "“)”"),
            ("inside(\"sphere:0,0,0,1", 8, "no closing"),
            ("inside(\"sphere:0,0,0,1\") > 1", 1, "a number is expected"),
        ] {
            let message = text.parse::<Expression>().unwrap_err();
            assert!(message.contains(&format!("column {column}:")), "{text}: {message}");
            assert!(message.contains(word), "{text}: {message}");
        }
        let deep = format!("{}1{} > 0", "(".repeat(200), ")".repeat(200));
        assert!(deep.parse::<Expression>().unwrap_err().contains("deeply"));
        let named: Expression = "x > 0 && abs(odd) > 1".parse().unwrap();
        assert_eq!((named.column_of("odd"), named.names().count()), (14, 2));
    }
}
