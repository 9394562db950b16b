"""From a filter specification and calibration data to fixed-point FPGA hardware.

The rooms of the package, each importing only from those to its right:
``cli -> sim -> gen -> hdl -> model``.
"""

import sys
from importlib import import_module

__version__ = "0.1.0"


def main() -> None:
    """Run the `sosmith` command; an interruption ends it in good order even while its modules load."""
    try:
        command = import_module("sosmith.cli")
    except KeyboardInterrupt:
        sys.exit(130)
    command.main()
