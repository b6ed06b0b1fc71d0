//! The `prismarch` program; all of it is in [`prismarch::cli`].

fn main() -> std::process::ExitCode {
    prismarch::cli::main()
}
