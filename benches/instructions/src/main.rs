//! Runs one workload of the core on a record of one or two lengths and says how many windows that was, so that the difference of two
//! counts of instructions is what windows cost, without the program's start and the tables of the plan.
//!
//! `one-at-a-time` times single samples through streams instead, with the fastest instructions.
//!
//! The record is a short stretch repeated, and outputs are fresh zeros: neither costs instructions that grow with the windows.

mod one_at_a_time;
mod workloads;

use std::process::ExitCode;

use tvident::simd::Instructions;

/// A counting machine knows no AVX-512, so this path is counted wherever the program runs.
const COUNTED: Instructions = if cfg!(target_arch = "x86_64") { Instructions::Avx2 } else { Instructions::Neon };

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["list"] => {
            for (name, _) in workloads::ALL {
                println!("{name}");
            }
            ExitCode::SUCCESS
        }
        ["one-at-a-time"] => match one_at_a_time::measure() {
            Ok(true) => ExitCode::SUCCESS,
            Ok(false) => fail("a sample takes more than it may"),
            Err(error) => fail(&error.to_string()),
        },
        [name, lengths @ ("1" | "2")] => run(name, if lengths == "1" { 1 } else { 2 }),
        _ => fail("usage: tvident-instructions list | one-at-a-time | NAME 1 | NAME 2"),
    }
}

fn run(name: &str, lengths: usize) -> ExitCode {
    if cfg!(debug_assertions) {
        return fail(
            "checks are built in, and would be counted; build with --config benches/instructions/shipped.toml",
        );
    }
    if !Instructions::force(Some(COUNTED)) {
        return fail(&format!("this processor has no {COUNTED:?}"));
    }
    let Some((_, workload)) = workloads::ALL.iter().find(|(one, _)| *one == name) else {
        return fail(&format!("no workload is called {name:?}; see list"));
    };
    match workload(lengths) {
        Ok(windows) => {
            println!("{windows}");
            ExitCode::SUCCESS
        }
        Err(error) => fail(&error.to_string()),
    }
}

fn fail(message: &str) -> ExitCode {
    eprintln!("{message}");
    ExitCode::FAILURE
}
