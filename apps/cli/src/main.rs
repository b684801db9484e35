//! The `ondelette` command.

fn main() {}
