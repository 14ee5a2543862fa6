"""Lists the benchmarks: what each measures, how long it takes, and the page it leaves.

./run python -m benchmarks
"""

from __future__ import annotations

import textwrap

from benchmarks.catalogue import CATALOGUE

WIDTH = 100  # characters


def main() -> None:
    """Print the list."""
    print("All are run from the checkout, by ./run COMMAND; --help tells their options.")
    for each in CATALOGUE:
        print(f"\n{each.command}\n    takes {each.takes}; leaves {each.path}")
        print(textwrap.fill(each.measures, WIDTH, initial_indent="    ", subsequent_indent="    "))


if __name__ == "__main__":
    main()
