"""The command `sosmith`, also as ``python -m sosmith``: an interrupt while its modules load ends it cleanly, too."""

from __future__ import annotations

import sys
from importlib import import_module


def main() -> None:
    """Run the command."""
    try:
        import_module("sosmith.cli").main()
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
