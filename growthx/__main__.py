"""`python -m growthx` is the command `growthx`."""

from growthx.cli import main

raise SystemExit(main())
