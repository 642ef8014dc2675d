//! `cargo board`.

fn main() -> std::process::ExitCode {
    gyronet_board::command::main()
}
