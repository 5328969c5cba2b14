"""``python -m ldtrefl``: the command line."""

import sys

from ldtrefl.cli import main

if __name__ == "__main__":
    sys.exit(main())
