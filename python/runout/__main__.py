"""The command line: `runout` and `python -m runout`."""

import sys

from ._native import main as _main


def main() -> int:
    """Does what the words of the command line ask for, and gives the exit status."""
    return _main(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
