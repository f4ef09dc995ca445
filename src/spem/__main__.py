"""Run the command line as ``python -m spem``."""

from spem.cli import main

if __name__ == "__main__":
    main()
