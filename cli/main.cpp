// kinevox: one program, one file per subcommand.
int main() { return 2; }
