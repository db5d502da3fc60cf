fn main() -> std::process::ExitCode {
    ident::command::run()
}
