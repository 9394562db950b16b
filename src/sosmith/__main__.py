"""The command `sosmith`, also as ``python -m sosmith``: an interrupt while its modules load ends it cleanly, too."""

from __future__ import annotations

import gc
import sys
from importlib import import_module

# What modules make when they load stays, and what a design leaves are few cycles: at Python's own threshold, looking
# for garbage takes a tenth of a short command.
gc.set_threshold(200_000)


def main() -> None:
    """Run the command."""
    try:
        import_module("sosmith.cli").main()
    except KeyboardInterrupt:
        sys.exit(130)
    finally:
        gc.freeze()  # the process ends: to look for garbage in all that was loaded would take a tenth of a design


if __name__ == "__main__":
    main()
