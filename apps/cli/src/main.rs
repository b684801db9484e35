//! The `ondelette` command.

mod transform;

use clap::Parser;

#[derive(Parser)]
#[command(version, about = "Light scenes and transform arrays with wavelets")]
enum Command {
    Transform(transform::TransformArgs),
}

fn main() -> std::process::ExitCode {
    let Command::Transform(args) = Command::parse();
    match transform::run(&args) {
        Ok(()) => 0.into(),
        Err(message) => {
            eprintln!("error: {message}");
            2.into()
        }
    }
}
