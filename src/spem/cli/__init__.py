"""The command line: parse, call, print."""


def main() -> None:
    """Run the command line on the arguments of the process, and exit with its status."""
    from spem.cli.app import run

    run()
