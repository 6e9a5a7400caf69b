"""Run the command line: python -m softvox_gym."""

import sys

from softvox_gym.cli import main

if __name__ == "__main__":
    sys.exit(main())
