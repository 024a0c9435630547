"""``python -m app``, the same as ``ltc-viewer``."""

from __future__ import annotations

import sys


def main() -> None:
    """Run the command line and exit with its code."""
    try:
        from app.cli.main import run
    except KeyboardInterrupt:  # imports take a moment
        sys.exit(130)
    sys.exit(run())


if __name__ == "__main__":
    main()
